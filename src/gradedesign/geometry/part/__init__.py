"""The solid part: triangles of a file, repaired, with smooth faces, regions and its own mesh.

Door: `Part`, `Region`, `PartSpec`, `PartReader`, `Repairer`, `RawTriangles`, `region_distance`.
"""
