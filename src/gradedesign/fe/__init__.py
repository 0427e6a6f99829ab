"""Elasticity on tetrahedra with scikit-fem: loads, supports, assembly, solve, stress."""
