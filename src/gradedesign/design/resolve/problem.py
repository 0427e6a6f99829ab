"""Design problem: the part with its loads and limits, which no iteration changes."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.lattice_files import LatticeFile
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.tets.mesher import Mesher
from gradedesign.geometry.tets.tet_mesh import signed_volumes
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.solver.linear_solver import LinearSolver


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """A case with its part meshed and its loads applied; the same in every iteration.

    Attributes
    ----------
    case : Case
    material : Material
    part : Part
    domain : DesignDomain
    space : TetSpace
        Quadratic tetrahedra of the part.
    solid_fraction : (M,) array
        Share of each tetrahedron that stays fully dense, 0 to 1.
    facets : dict of region to (k, 3) int array
    loads : tuple of PartLoadCase
    solver : LinearSolver
    limits : tuple of Limit
        Those relative to the solid part are resolved by `solid.with_solid`.
    evaluated : (M,) bool array
        Tetrahedra outside the zones.
    support_zones : tuple of SupportZone
        In which stress is not judged.
    analysis : ExplicitAnalysis
    mesher : Mesher
        Of the acceptance.
    lattice_files : tuple of LatticeFile
        Files of the printed lattice.
    """

    case: Case
    material: Material
    part: Part
    domain: DesignDomain
    space: TetSpace
    solid_fraction: FloatArray
    facets: dict[str, IntArray]
    loads: tuple[PartLoadCase, ...]
    solver: LinearSolver
    limits: tuple[Limit, ...]
    evaluated: BoolArray
    support_zones: tuple[SupportZone, ...]
    analysis: ExplicitAnalysis
    mesher: Mesher
    lattice_files: tuple[LatticeFile, ...] = ()


def part_volume(problem: Problem) -> float:
    """Volume of the part's tetrahedra, mm^3."""
    return float(signed_volumes(problem.space.mesh).sum())


def unjudged_share(problem: Problem) -> float:
    """Share of the part's volume in the zones around supports."""
    volumes = signed_volumes(problem.space.mesh)
    return 1.0 - float(volumes @ problem.evaluated / volumes.sum())
