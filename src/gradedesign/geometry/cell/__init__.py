"""Cells: families, calibration of level and density, thinnest walls, mixes.

Door: `Cell`, `CellFamily`, `CellMaker`, `Cells`, `calibrate`, `wall_mm`, `evaluate_shape`.
"""
