"""From the names of a case to records: cells, laws, part, loads, limits, the design problem.

Door: `Plan`, `DesignModel`, `Registry`, `StatedLattice`, `lookup`.
"""
