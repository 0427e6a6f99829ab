"""The printed solid with its loads and supports: what every explicit analysis is given."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from dataclasses import field as dataclass_field

from gradedesign.arrays import Field
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.tets.mesher import PYTETWILD, Mesher
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.solver.linear_solver import LinearSolver


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrintedSolid:
    """A lattice design with everything that its analysis and acceptance need.

    Attributes
    ----------
    memory : int, bytes
        That an analysis, or the mesher, may take.
    regions : mapping of name to Region
        On the surface of the part.
    support_zones : tuple of SupportZone
        In which stress is not judged.
    stress_limit : float or None, MPa
    percentile : float
        Of the volume, per cent.
    solver : LinearSolver
        Of the analyses on tetrahedra.
    mesher : Mesher
        Of the acceptance.
    field : callable, optional
        Solid to analyse instead of the design's own lattice, such as the printed surface read
        back: points ``(3, ...)`` mm to ``(...)``, negative inside. Finite cells take it.
    volume : float, optional, mm^3
        That the surface of that solid encloses.
    grading : callable, optional
        How much larger elements may be than at the thinnest wall: points ``(3, ...)`` mm to ratios
        ``(...)``. Finite cells take it.
    goals : mapping of LimitKey to DisplacementGoal
        Values of limits whose own error an analysis is to estimate. Finite cells do.
    modes : mapping of LimitKey to ModeGoal
        Natural frequencies and load factors that every analysis is to find.
    """

    load_cases: tuple[LoadCaseSpec, ...]
    memory: int
    design: LatticeDesign
    material: Material
    regions: Mapping[str, Region]
    support_zones: tuple[SupportZone, ...]
    stress_limit: float | None
    percentile: float
    solver: LinearSolver = MULTIGRID
    mesher: Mesher = PYTETWILD
    field: Field | None = None
    volume: float | None = None
    grading: Field | None = None
    goals: Mapping[Hashable, DisplacementGoal] = dataclass_field(default_factory=dict)
    modes: Mapping[Hashable, ModeGoal] = dataclass_field(default_factory=dict)
