"""The tables of a World: built from a scene, kept for all of its worlds, changed while it runs."""
