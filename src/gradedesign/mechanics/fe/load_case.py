"""Load cases on the tetrahedra of a part or of a lattice, and their load vectors.

Regions are found geometrically on the surface of the mesh, never by node numbers, and each load
arrives with the resultant force and moment that it has on the solid part's own surface.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, lock, locked
from gradedesign.errors import SolverError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.facet_quadrature import facet_points, facet_weights
from gradedesign.mechanics.fe.facets import facet_areas, facet_nodes
from gradedesign.mechanics.fe.loads import (
    body_force,
    pressure_force,
    resultant,
    resultant_load,
    thermal_force,
    traction_force,
)
from gradedesign.mechanics.fe.region_load import RegionLoad, Triple, bearing_field, region_resultant
from gradedesign.mechanics.fe.solution import LoadVector, Solution
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import Stiffness
from gradedesign.mechanics.fe.supports import Displacement, Supports, supports_on

#: Resultant force and moment on the mesh may differ from those on the part by this share. Chosen,
#: not measured.
_RESULTANT_TOLERANCE = 1e-3


class Support(Protocol):
    """A held region."""

    @property
    def region(self) -> str:
        """Name."""

    @property
    def displacement(self) -> Displacement:
        """Prescribed components, mm; None where free."""


class LoadCaseSpecification(Protocol):
    """Supports and loads by regions."""

    @property
    def name(self) -> str:
        """Of the load case."""

    @property
    def fix(self) -> Sequence[Support]:
        """Supports."""

    @property
    def load(self) -> Sequence[RegionLoad]:
        """Loads."""

    @property
    def acceleration(self) -> Triple:
        """Of the body, mm/s^2."""

    @property
    def temperature_change(self) -> float:
        """Uniform, K."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartLoadCase:
    """One load case on a discretised part."""

    name: str
    supports: Supports
    force: FloatArray  #: ``(3, N)``, N. Consistent nodal forces that do not depend on density.
    #: ``(3,)``, mm/s^2. Body acceleration; its force follows the mass of the design.
    acceleration: FloatArray
    temperature_change: float = 0.0  #: K.

    def __post_init__(self) -> None:
        lock(self, force=(3, None))
        object.__setattr__(self, "acceleration", locked(self.acceleration, (3,)))


def case_loads(
    space: TetSpace,
    load_cases: Sequence[LoadCaseSpecification],
    regions: Mapping[str, Region],
    facets: Mapping[str, IntArray],
) -> tuple[PartLoadCase, ...]:
    """Supports and forces of every load case.

    Raises `SolverError` if a resultant on the mesh misses the part's by more than 0.1 %.

    ``load_cases``: such as ``[[load_case]]`` of a case file. ``regions``: by name; on the solid
    part's surface: they define the resultants. ``facets``: by name, each ``(k, 3)``; the same
    regions on the surface of the mesh.
    """
    return tuple(
        PartLoadCase(
            name=spec.name,
            supports=supports_on(space, [(facets[f.region], f.displacement) for f in spec.fix]),
            force=sum(
                (region_force(space, regions[s.region], facets[s.region], s) for s in spec.load),
                np.zeros(space.nodes.shape),
            ),
            acceleration=np.asarray(spec.acceleration, dtype=np.float64),
            temperature_change=spec.temperature_change,
        )
        for spec in load_cases
    )


def mechanical_force(space: TetSpace, case: PartLoadCase, mass_density: FloatArray) -> FloatArray:
    """Nodal forces of the loads and the inertia of a design, ``(3, N)``, N."""
    if not np.any(case.acceleration):
        return case.force
    return case.force + body_force(space, mass_density, case.acceleration)


def load_vector(
    space: TetSpace,
    case: PartLoadCase,
    stiffness: Stiffness,
    mass_density: FloatArray,
    thermal_expansion: float,
) -> LoadVector:
    """Nodal forces of a load case on a design: its loads, inertia and thermal expansion.

    ``stiffness``: what the thermal strain is held by. ``mass_density (M,)``, t/mm^3.
    ``thermal_expansion``, 1/K.
    """
    force = mechanical_force(space, case, mass_density)
    if case.temperature_change:
        heated = thermal_force(space, stiffness, thermal_expansion, case.temperature_change)
        force = force + heated
    return LoadVector(name=case.name, supports=case.supports, force=force)


def region_force(space: TetSpace, region: Region, facets: IntArray, spec: RegionLoad) -> FloatArray:
    """Nodal forces of one load with the resultant it has on the solid part, ``(3, N)``, N."""
    force, moment = region_resultant(region, spec)
    nodal = np.zeros(space.nodes.shape)
    if spec.pressure is not None:
        nodal += pressure_force(space, facets, spec.pressure)
    if spec.bearing is not None:
        points = facet_points(space.mesh.points[:, facets.T])
        weights = facet_weights(facet_areas(space, facets))
        traction = bearing_field(region, spec.bearing, points, weights)
        nodal += traction_force(space, facets, traction)
    have_force, have_moment = resultant(space, nodal, region.centroid)
    nodal += resultant_load(
        space, facets, force - have_force, moment - have_moment, region.centroid
    )
    _check_resultant(region, facets, space, nodal, force, moment)
    return nodal


def region_nodes(space: TetSpace, facets: IntArray) -> IntArray:
    """Nodes of a region, edge middles included, ``(k,)``."""
    return np.unique(facet_nodes(space, facets))


def region_shares(space: TetSpace, facets: IntArray) -> FloatArray:
    """Share of a region's area that each node of `region_nodes` stands for, ``(k,)``.

    They sum to 1. The integral over the facets of their shape functions, so that
    ``u[:, nodes] @ shares`` is the mean displacement: corners of quadratic facets have none.
    """
    nodes = facet_nodes(space, facets)
    areas = facet_areas(space, facets)
    sharing = nodes[3:] if space.order == 2 else nodes
    total = np.bincount(
        sharing.ravel(), weights=np.tile(areas / 3.0, 3), minlength=space.nodes.shape[1]
    )
    return total[np.unique(nodes)] / float(areas.sum())


def _check_resultant(
    region: Region,
    facets: IntArray,
    space: TetSpace,
    nodal: FloatArray,
    force: FloatArray,
    moment: FloatArray,
) -> None:
    """Raise unless force and moment arrive to 0.1 %."""
    got_force, got_moment = resultant(space, nodal, region.centroid)
    arm = float(np.linalg.norm(np.ptp(region.corners.reshape(-1, 3), axis=0)))
    scale = max(float(np.linalg.norm(force)), float(np.linalg.norm(moment)) / arm, 1e-300)
    miss = max(
        float(np.linalg.norm(got_force - force)),
        float(np.linalg.norm(got_moment - moment)) / arm,
    )
    # Pressure on a closed ring has no resultant: its scale is then the sum of what acts.
    scale = max(scale, float(np.abs(nodal).sum()) * 1e-3)
    if miss > _RESULTANT_TOLERANCE * scale:
        raise SolverError(
            f"the load on region '{region.name}' arrives on the mesh with force {got_force} N "
            f"and moment {got_moment} N mm, expected {force} N and {moment} N mm within "
            f"0.1 %; {len(facets)} facets carry it; refine the mesh or widen the region"
        )


def work_of(forces: Sequence[FloatArray], solutions: Sequence[Solution]) -> dict[str, float]:
    """Work of nodal forces on the displacements of their load cases, N mm."""
    return {
        solution.name: float(np.sum(force * solution.displacement))
        for force, solution in zip(forces, solutions, strict=True)
    }
