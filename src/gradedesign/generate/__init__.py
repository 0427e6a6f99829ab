"""Lattices stated by the user, built without sizing."""
