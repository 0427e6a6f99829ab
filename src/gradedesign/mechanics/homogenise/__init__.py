"""Effective properties of periodic cells: stiffness, strength, buckling, walls of few cells."""
