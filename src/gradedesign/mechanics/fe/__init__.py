"""Elasticity on tetrahedra with scikit-fem: loads, supports, stiffness, solution, stress."""
