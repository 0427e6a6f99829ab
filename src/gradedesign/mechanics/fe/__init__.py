"""Elasticity on tetrahedra with scikit-fem: loads, supports, stiffness, solution, stress.

Door: `TetSpace`, `LoadCaseSpec`, `PartLoadCase`, `Supports`, `Solution`, `ElasticSystem`,
`solve_elastic`.
"""
