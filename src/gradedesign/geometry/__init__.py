"""Fields, surfaces, parts, cells and lattices: no stress, no law."""
