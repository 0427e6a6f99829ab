"""Sparse algebra of elasticity: conjugate gradients, multigrid, direct and eigenvalue solvers."""
