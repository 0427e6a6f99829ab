"""Explicit analyses of a printed solid: their protocol, the built-in one, their measures.

Door: `ExplicitAnalysis`, `ExplicitResult`, `PrintedSolid`, `PlannedSolid`, `SolvedSolid`,
`FINITE_CELLS`, `Correction`.
"""
