"""Tetrahedral meshes: the mesher in its own process, quality, location of points.

Door: `TetMesh`, `Mesher`, `centroids`, `signed_volumes`, `tetrahedralize`, `locate`.
"""
