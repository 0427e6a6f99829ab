"""The lattice of a stated density."""
