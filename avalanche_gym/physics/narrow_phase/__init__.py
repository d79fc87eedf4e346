"""Contacts between two placed shapes: one file a pair or family of pairs."""
