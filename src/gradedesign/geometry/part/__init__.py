"""The solid part: triangles of a file, repaired, with smooth faces, regions and its own mesh."""
