"""Sparse algebra of elasticity: conjugate gradients, multigrid, direct and eigenvalue solvers.

Door: `LinearSolver`, `EigenSolver`, `LinearSystem`, `LinearAnswer`, `free_modes`.
"""
