"""Cells: families, calibration of level and density, thinnest walls, mixes."""
