"""Tetrahedral meshes: the mesher in its own process, quality, location of points."""
