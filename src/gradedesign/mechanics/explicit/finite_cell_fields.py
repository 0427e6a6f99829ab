"""Solved displacements on finite cells, in the protocol of explicit analyses."""

from __future__ import annotations

import logging
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.islands import remove_islands
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles
from gradedesign.mechanics.explicit.analysis import (
    Discretisation,
    StressSample,
    SurfaceFields,
    VolumeFields,
)
from gradedesign.mechanics.finite_cell.elements import SUBCELLS, Elements, solid_fraction
from gradedesign.mechanics.finite_cell.recovery import recovered_stress
from gradedesign.mechanics.finite_cell.result import FiniteCellResult, solution_of
from gradedesign.mechanics.finite_cell.space import node_points
from gradedesign.mechanics.finite_cell.stress import (
    SolidParts,
    SolidPoints,
    displacement_at,
    points_of,
    von_mises,
)
from gradedesign.mechanics.finite_cell.surface import element_table, locate, reference_of
from gradedesign.mechanics.finite_cell.traction_residual import GoalResidual

log = logging.getLogger(__name__)

#: Sample points whose stress or displacement is worked out at once. Bounds the memory; the result
#: does not depend on it. Chosen, not measured.
CHUNK = 2**18
#: How far around points outside the solid its surface is looked for at first, in elements. Chosen,
#: not measured.
REACH = 2.0
#: Volume of the analysed surface over that of the elements, less one, from which the surface is too
#: coarse to stand for them: walls thinner than its grid are missing in it. Chosen, not measured.
CONTOUR_TOLERANCE = 0.05
#: Nodes of VTK's triquadratic hexahedron as numbers of ours, x fastest: corners, edges, faces,
#: centre.
_VTK_ORDER = np.array(
    [0, 2, 8, 6, 18, 20, 26, 24,
     1, 5, 7, 3, 19, 23, 25, 21, 9, 11, 17, 15,
     12, 14, 10, 16, 4, 22, 13]
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteCellFields:
    """Solved displacements of a printed solid on finite cells."""

    result: FiniteCellResult
    field: Field  #: Of the solid, negative inside.
    division: Discretisation
    parts: SolidParts  #: Whose centroids are the sample points.
    bodies: int  #: Connected components of the solid.

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Names, in the order of the case."""
        return tuple(solution.name for solution in self.result.solutions)

    @property
    def points(self) -> FloatArray:
        """Centroids of the solid in the sub-cells of the elements, ``(3, n)``, mm."""
        return points_of(self.parts).points

    @property
    def volumes(self) -> FloatArray:
        """Solid that each of them stands for, ``(n,)``, mm^3."""
        return points_of(self.parts).volume

    @property
    def work(self) -> dict[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""
        return self.result.work

    @property
    def mode_values(self) -> Mapping[Hashable, float]:
        """Natural frequencies, Hz, and load factors by the keys of the problem's modes."""
        return self.result.mode_values

    @property
    def traction_residual(self) -> Mapping[str, float]:
        """Squared residual of the tractions over the energy, by load case under forces alone."""
        return {
            s.name: s.traction_residual
            for s in self.result.solutions
            if s.traction_residual is not None
        }

    @property
    def goal_residuals(self) -> Mapping[Hashable, GoalResidual]:
        """Residuals of the goals and modes of the problem, by their keys."""
        return {key: value for s in self.result.solutions for key, value in s.goals.items()}

    def von_mises(self, load_case: str) -> FloatArray:
        """Von Mises stress at the sample points, ``(n, 1)``, MPa."""
        values = np.zeros(self.parts.number.size)
        for part in self._chunks():
            values[part] = von_mises(self._stress(load_case, points_of(self.parts, part)))
        return values[:, None]

    def stress_within(self, load_case: str, lower: FloatArray, upper: FloatArray) -> StressSample:
        """Stress at the sample points in the box between two corners, mm."""
        points = self.points
        inside = np.all((points >= lower[:, None]) & (points <= upper[:, None]), axis=0)
        at = points_of(self.parts, np.flatnonzero(inside))
        return StressSample(points=at.points, volumes=at.volume, stress=self._stress(load_case, at))

    def displacement_at(self, load_case: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement at points, ``(3, m)``, mm, and their distances from the solid, (m,), mm.

        Outside, that of the nearest point of the solid's surface.
        """
        nearest, distance = self._nearest(np.asarray(points, dtype=np.float64))
        return self._displacement(load_case, nearest), distance

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements where the solid reaches a region, ``(3, k)``, mm."""
        return self.result.region_displacement(region, load_case)

    def mean_displacement(self, region: str, load_case: str) -> FloatArray:
        """Mean displacement over the area where the solid reaches a region, ``(3,)``, mm."""
        return self.result.mean_displacement(region, load_case)

    def mean_length(self, region: str, load_case: str) -> float:
        """Mean length of the displacement over the area where the solid reaches a region, mm."""
        return self.result.mean_length(region, load_case)

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of the solid, mm: of its sample points and of the regions."""
        u = solution_of(self.result, load_case).u
        largest = []
        for part in self._chunks():
            at = points_of(self.parts, part)
            moved = displacement_at(
                self.result.elements, self.result.space, u, at.element, at.points
            )
            largest.append(float(np.linalg.norm(moved, axis=0).max()))
        for region in self.result.places:
            moved = self.region_displacement(region, load_case)
            largest.append(float(np.linalg.norm(moved, axis=0).max()))
        return max(largest)

    def surface_fields(self, load_case: str) -> SurfaceFields:
        """Surface of the field with the stress and displacement of the elements there."""
        report_step("stress for the pictures")
        surface = self._contour()
        points = surface.vertices.T
        stress = self._stress(load_case, self._surface_points(points))
        return SurfaceFields(
            surface=surface,
            von_mises=von_mises(stress),
            displacement=self._displacement(load_case, points),
        )

    def volume_fields(self, sampled: Mapping[str, FloatArray]) -> VolumeFields:
        """Triquadratic hexahedra with nodal displacements and means of fields ``(n,)``."""
        result = self.result
        fraction, at = solid_fraction(result.elements), points_of(self.parts)
        weight = np.bincount(at.element, weights=at.volume, minlength=fraction.size)
        # An element whose solid is too little for a sample point shows 0.
        weight = np.maximum(weight, np.finfo(float).tiny)
        return VolumeFields(
            points=node_points(result.elements, result.space),
            elements=result.space.nodes[:, _VTK_ORDER].T.astype(np.int64),
            point_data={
                f"displacement {solution.name} [mm]": solution.u.T for solution in result.solutions
            },
            element_data={"solid_volume_fraction [-]": fraction}
            | {
                name: np.bincount(at.element, weights=values * at.volume, minlength=fraction.size)
                / weight
                for name, values in sampled.items()
            },
        )

    def _contour(self) -> SurfaceMesh:
        """Surface of the field, on sub-cells of the elements where a coarser grid loses walls."""
        elements, volume = self.result.elements, float(self.volumes.sum())
        grid = elements.grid
        upper = grid.lower + grid.edges * grid.shape

        def contour(size: float) -> SurfaceMesh:
            raw = extract_surface(self.field, grid.lower, upper, size)
            return remove_islands(raw, keep=self.bodies, max_share=1.0)[0]

        try:
            surface = contour(self.division.surface_size)
            if abs(enclosed_volume(surface) / volume - 1.0) <= CONTOUR_TOLERANCE:
                return surface
        except LatticeError as error:
            # On the coarse grid nothing may be left; what is left of the fine one is looked at.
            log.info("surface for pictures at %.3g mm: %s", self.division.surface_size, error)
        return contour(float(grid.edges.max()) / SUBCELLS)

    def _chunks(self) -> Iterator[slice]:
        """The sample points, some at once."""
        return (slice(k, k + CHUNK) for k in range(0, self.parts.number.size, CHUNK))

    def _stress(self, load_case: str, at: SolidPoints) -> FloatArray:
        """Stress at points with their elements, ``(3, 3, m)``, MPa."""
        result, solution = self.result, solution_of(self.result, load_case)
        return recovered_stress(
            result.elements, result.space, solution.u, result.moduli, at, solution.thermal_strain
        )

    def _displacement(self, load_case: str, points: FloatArray) -> FloatArray:
        """Displacement of the nearest element at points in or on the solid, ``(3, m)``, mm."""
        u = solution_of(self.result, load_case).u
        element = self._element(points)
        return displacement_at(self.result.elements, self.result.space, u, element, points)

    def _surface_points(self, points: FloatArray) -> SolidPoints:
        """Points on the surface with their elements; none stands for a volume."""
        element = self._element(points)
        return SolidPoints(
            points=points,
            volume=np.zeros(element.size),
            element=element,
            reference=reference_of(self.result.elements, element, points),
        )

    def _element(self, points: FloatArray) -> IntArray:
        """Element of points in or on the solid, or that of the nearest sample point, ``(m,)``."""
        elements: Elements = self.result.elements
        element = locate(elements, element_table(elements), points)
        lost = element < 0
        if lost.any():
            at = points_of(self.parts)
            _, near = KDTree(at.points.T).query(points[:, lost].T)
            element[lost] = at.element[near]
        return element

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nearest points of the solid, ``(3, m)``, and their distances, ``(m,)``, mm."""
        grid = self.result.elements.grid
        low, high = grid.lower[:, None], (grid.lower + grid.edges * grid.shape)[:, None]
        table = element_table(self.result.elements)
        in_element = locate(self.result.elements, table, points) >= 0
        outside = ~in_element
        outside[in_element] = self.field(points[:, in_element]) > 0.0
        nearest, distance = points.copy(), np.zeros(points.shape[1])
        reach = REACH * float(grid.edges.max())
        while outside.any():
            query = points[:, outside]
            lower = np.maximum(query.min(axis=1) - reach, low[:, 0])
            upper = np.minimum(query.max(axis=1) + reach, high[:, 0])
            whole = (lower <= low[:, 0]).all() and (upper >= high[:, 0]).all()
            try:
                surface = extract_surface(self.field, lower, upper, self.division.surface_size)
            except LatticeError:
                if whole:
                    raise
                reach *= 2.0
                continue
            tree = build_triangle_tree(surface.vertices[surface.faces])
            gap, _, closest = closest_triangles(tree, query)
            index = np.flatnonzero(outside)
            nearest[:, index], distance[index] = closest, gap
            # What lies beyond the box may be nearer only to points farther off than its reach.
            outside[index] = (gap > reach) & (not whole)
            reach *= 2.0
        return nearest, distance
