"""Effective properties of periodic cells: stiffness, strength, buckling, walls of few cells.

Door: `CellProperties`, `computed_law`, `mix_factors`.
"""
