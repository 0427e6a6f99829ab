"""The solid of a part with a lattice of some density, before it is built."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.geometry.cell.cell_surface import CellSurface
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors
from gradedesign.mechanics.explicit.analysis import PlannedSolid

#: Facets whose normal is this near to an axis lie on planes of a grid. Chosen, not measured.
_ACROSS = 1.0 - 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedPart:
    """A part that will hold lattice."""

    box: tuple[float, float, float]  #: mm. Edges of its box.
    latticed: float  #: mm^3. Volume that becomes lattice, and volume that stays solid.
    solid: float  #: As `latticed`.
    #: mm^2. Projected area of the faces that lie across no axis: those across one lie on planes of
    #: the grid and cut no element.
    inclined: float
    inner: float  #: mm^2. Projected area of the inner faces of its skin; 0 without one.
    load_cases: int
    goals: int = 0  #: Values of limits whose own error acceptance estimates.
    modes: int = 0  #: Lowest natural frequencies that analyses find.


def planned_part(
    surface: SurfaceMesh,
    domain: DesignDomain,
    *,
    latticed: float,
    solid: float,
    load_cases: int,
    goals: int,
    modes: int,
) -> PlannedPart:
    """A part from its surface and the volumes of its lattice and of what stays solid, mm^3."""
    areas = np.abs(area_vectors(surface))
    inclined = areas.max(axis=1) < _ACROSS * np.linalg.norm(areas, axis=1)
    x, y, z = np.ptp(surface.vertices, axis=0).tolist()
    return PlannedPart(
        box=(x, y, z),
        latticed=latticed,
        solid=solid,
        inclined=float(areas[inclined].sum()),
        inner=float(areas.sum()) if domain.closed else 0.0,
        load_cases=load_cases,
        goals=goals,
        modes=modes,
    )


def planned_solid(part: PlannedPart, rho: float, lattice: CellSurface) -> PlannedSolid:
    """Volume and surface of a part at a mean density of its lattice.

    ``rho``: mean relative density. ``lattice``: mean of the lattice.
    """
    volume = part.solid + part.latticed * rho
    share = 1.0 if part.inner else volume / (part.solid + part.latticed)
    return PlannedSolid(
        box=part.box,
        volume=float(volume),
        projections=float(part.latticed * lattice.projections + share * part.inclined + part.inner),
        curvature=float(part.latticed * lattice.curvature),
        load_cases=part.load_cases,
        goals=part.goals,
        modes=part.modes,
    )
