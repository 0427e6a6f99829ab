"""Maps from millimetres to cell coordinates: straight, bent, along frames, graded in size.

Door: `CellMap`, `local_cells`, `turned_axes`, `map_report`.
"""
