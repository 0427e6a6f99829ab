"""Elasticity on a plain grid that any implicit field cuts: quadratic finite cells.

Door: `CutProblem`, `divide`, `solve_divided`, `displacement_at`, `GoalResidual`.
"""
