"""The protocol of explicit analyses, used by the loop, acceptance and files.

An analysis solves the printed solid at a resolution. What it returns holds sample points with
stress, and displacements by region and by point; how it divides the solid is its own matter.
Above 300 lines: the protocol with the records that it exchanges.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.finite_cell.traction_residual import GoalResidual
from gradedesign.mechanics.limits.limits_schema import LimitsSpec

#: Resolution of the surface of an analysed solid over the edge of the elements: triangles of the
#: exported surface, and edges and tolerances of acceptance, follow it. With bricks of 1.4 walls,
#: the default across sheets, that is 0.8 of a wall. Chosen, not measured.
SURFACE_PER_ELEMENT = 0.56


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """Element sizes with which a design is analysed.

    Attributes
    ----------
    spacing : float, mm
        Edge of the elements.
    coarsest : float or None, mm
        Largest spacing to take instead where that one does not fit the memory; the analysis may
        then refine too, where the solid is not held. None: ``spacing`` or an error.
    """

    spacing: float
    coarsest: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSolid:
    """A solid that is not built yet.

    Attributes
    ----------
    box : (float, float, float), mm
        Edges of the part's box.
    volume : float, mm^3
        Expected of the solid.
    projections : float, mm^2
        Area of its surface projected along each of three axes, together.
    curvature : float, mm
        Integral of mean curvature over its surface.
    goals : int
        Values of limits whose own error acceptance estimates, each by the solution of a dual.
    modes : int
        Lowest modes that are found.
    """

    box: tuple[float, float, float]
    volume: float
    projections: float
    curvature: float
    load_cases: int
    goals: int = 0
    modes: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisEstimate:
    """Size of an analysis before it starts.

    Attributes
    ----------
    memory_bytes : int
        That it asks of ``[run] memory``.
    mesh_s, solve_s : float, s
        Of dividing the solid and of solving every load case, on two idle cores.
    """

    unknowns: int
    memory_bytes: int
    mesh_s: float
    solve_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Discretisation:
    """Elements and unknowns of a solved solid.

    Attributes
    ----------
    made_by : str
        Mesher, or another way to divide, such as ``"finite cells"``.
    mesh_size : float, mm
        Edge of its elements, reported beside its values.
    requested : float, mm
        Spacing that led here, before it was fitted to the part.
    refused : tuple of str
        Faults of the spacings that were tried first.
    dropped_components : int
        Disconnected components that were left out.
    seconds : float
        That it took.
    """

    made_by: str
    mesh_size: float
    unknowns: int
    requested: float
    refused: tuple[str, ...] = ()
    dropped_components: int = 0
    seconds: float = 0.0

    @property
    def surface_size(self) -> float:
        """Resolution of the solid's surface, mm, see `SURFACE_PER_ELEMENT`."""
        return SURFACE_PER_ELEMENT * self.mesh_size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressSample:
    """Stress of a load case at points of the solid.

    Attributes
    ----------
    points : (3, m) array, mm
    volumes : (m,) array, mm^3
        Solid that each point stands for.
    stress : (3, 3, m) array, MPa
    """

    points: FloatArray
    volumes: FloatArray
    stress: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SurfaceFields(ShownRecord):
    """The surface of a solved solid in one load case, for pictures.

    Attributes
    ----------
    surface : SurfaceMesh
        Of n vertices.
    von_mises : (n,) array, MPa
    displacement : (3, n) array, mm
    """

    surface: SurfaceMesh
    von_mises: FloatArray
    displacement: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VolumeFields:
    """Elements of a solved solid with their fields, for files.

    Attributes
    ----------
    points : (3, N) array, mm
    elements : (k, M) int array
        Nodes in VTK's order; k is one that `output.vtu.write_vtu` knows.
    point_data, element_data : mapping of str to array
        Fields ``(..., N)`` and ``(..., M)``, each name with its unit in brackets.
    """

    points: FloatArray
    elements: IntArray
    point_data: Mapping[str, FloatArray] = field(default_factory=dict)
    element_data: Mapping[str, FloatArray] = field(default_factory=dict)


class SolvedSolid(Protocol):
    """Displacements and stresses of a printed solid in every load case; n sample points."""

    @property
    def load_cases(self) -> Sequence[str]:
        """Names, in the order of the case."""

    @property
    def points(self) -> FloatArray:
        """Sample points, ``(3, n)``, mm."""

    @property
    def volumes(self) -> FloatArray:
        """Solid that each sample point stands for, ``(n,)``, mm^3."""

    @property
    def division(self) -> Discretisation:
        """Elements and unknowns of the solid."""

    @property
    def work(self) -> Mapping[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""

    @property
    def mode_values(self) -> Mapping[Hashable, float]:
        """Natural frequencies, Hz, and load factors by the keys of the printed solid's modes."""

    @property
    def traction_residual(self) -> Mapping[str, float]:
        """Squared residual of the tractions over the energy, by load case.

        Empty where an analysis does not compute it; see `finite_cell.traction_residual`.
        """

    @property
    def goal_residuals(self) -> Mapping[Hashable, GoalResidual]:
        """Residuals of the goals of the printed solid, by their keys.

        Empty where an analysis does not compute them; see `finite_cell.goal_residual`.
        """

    def von_mises(self, load_case: str) -> FloatArray:
        """Von Mises stress, ``(n, q)``, MPa: q values, each for a q-th of a point's volume."""

    def stress_within(self, load_case: str, lower: FloatArray, upper: FloatArray) -> StressSample:
        """Stress in the box between two corners, mm."""

    def displacement_at(self, load_case: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement at points, ``(3, m)``, mm, and their distances from the solid, (m,), mm.

        Outside, that of the nearest point of the solid.
        """

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of a region's solid, ``(3, k)``, mm."""

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area where the solid reaches a region, ``(3,)``, mm."""

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area where the solid reaches a region, mm."""

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement anywhere, mm."""

    def surface_fields(self, load_case: str) -> SurfaceFields:
        """The surface with stress and displacement."""

    def volume_fields(self, sampled: Mapping[str, FloatArray]) -> VolumeFields:
        """The elements with the displacement of every load case.

        ``sampled`` holds fields at the sample points, ``(n,)``, for the elements around them.
        """


def _takes_every_case(_limits: LimitsSpec, _load_cases: Sequence[LoadCaseSpec]) -> str:
    """No case is refused."""
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplicitAnalysis:
    """A way to analyse printed solids, as a plugin registers it.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[run] analysis`` names.
    solve : callable
        ``solve(PrintedSolid, Resolution, say) -> SolvedSolid``; ``say(message)`` receives why a
        spacing was refused and which is tried next. A `ResourceError` where the memory of the case
        does not suffice, a `MeshError` or `LatticeError` where the solid is not held.
    estimate : callable
        ``estimate(PlannedSolid, spacing) -> AnalysisEstimate``.
    fitted_spacing : callable
        ``fitted_spacing(PlannedSolid, spacing, memory_bytes) -> float``: the spacing, mm, that
        `solve` is expected to take where that one is asked for.
    elements_per_wall : callable
        ``elements_per_wall(cell) -> float``: across the thinnest wall or strut of a cell, for the
        accuracy that a verdict needs.
    elements_per_layer : float
        Across skins and margins of passive regions.
    coarsest : float
        Largest spacing over the one that walls and layers ask for, where that does not fit the
        memory.
    affordable : float
        Unknowns that take little of any budget: solids that need fewer are analysed finer, see
        :func:`gradedesign.mechanics.explicit.small_solid.small_solid_spacing`.
    closes : float
        Width of the gaps between faces of a part that its elements may join, over their edge.
    refuses : callable
        ``refuses(LimitsSpec, load cases) -> str``: the limit or load that it cannot judge or
        analyse, in a sentence; empty where there is none. Asked before the part is read.
    """

    name: str
    solve: Callable[[PrintedSolid, Resolution, Callable[[str], None]], SolvedSolid]
    estimate: Callable[[PlannedSolid, float], AnalysisEstimate]
    fitted_spacing: Callable[[PlannedSolid, float, float], float]
    elements_per_wall: Callable[[Cell], float]
    elements_per_layer: float
    coarsest: float = 1.0
    affordable: float = 0.0
    closes: float = 1.0
    refuses: Callable[[LimitsSpec, Sequence[LoadCaseSpec]], str] = _takes_every_case
