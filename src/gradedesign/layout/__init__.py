"""Placement of cells in a part: the design domain, the cell map, sizes and rotations."""
