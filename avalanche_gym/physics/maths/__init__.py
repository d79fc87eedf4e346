"""Vectors, quaternions and matrices as tuples of floats: what every kernel computes with."""
