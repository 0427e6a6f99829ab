"""The homogenised part and its optimiser: densities that meet every limit.

Door: `HomogenisedModel`, `homogenised_system`, `SolvedState`, `SizingResult`, `DensityFilter`,
`total_mass`.
"""
