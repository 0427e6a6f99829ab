"""From the case file to records: part, material, cell, law, loads, limits, meshes."""
