"""Boxes of submodels: the most stressed cells, cut from the exported surface."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.boolean import intersection
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.measures import shared_volumes
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhoods
from gradedesign.mechanics.fe.stress import weighted_percentile

log = logging.getLogger(__name__)

#: A submodel is analysed this share of a cell beyond the cube that it judges, and is enlarged by as
#: much; the second share is for parts with no room for the first one anywhere. Chosen, not
#: measured.
BUFFERS = (0.5, 0.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Submodel:
    """Cube of one cell whose stress is evaluated, and the larger box that is analysed around it."""

    centre: tuple[float, float, float]  #: mm.
    half: float  #: mm. Half the edge of the evaluation box.
    value: float  #: MPa. Stress percentile of the driving analysis in the evaluation box.
    load_case: str  #: The load case with that value.
    #: Buffer on each side that is analysed but not evaluated, cells: x low, x high, y low, ...
    buffer: tuple[float, ...] = (BUFFERS[0],) * 6

    @property
    def enlarged(self) -> bool:
        """Whether a side lies farther out than those of a submodel that was not enlarged."""
        return max(self.buffer) > BUFFERS[0]


def submodel_box(submodel: Submodel) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of the analysed box, mm."""
    reach = submodel.half * (1 + 2 * np.asarray(submodel.buffer).reshape(3, 2))
    centre = np.asarray(submodel.centre)
    return centre - reach[:, 0], centre + reach[:, 1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Volume in which submodels may lie."""

    #: Each ``(k, 3, 3)``, mm. Triangles that no analysed box may touch: held and loaded regions,
    #: whose supports and loads a submodel does not carry.
    avoid: Sequence[FloatArray] = ()
    buffer: float = BUFFERS[0]  #: Buffer around the evaluation box, cells.


def enlarged_submodel(submodel: Submodel, avoid: Sequence[FloatArray]) -> Submodel | None:
    """The submodel with half a cell more on every side that then touches no avoided triangle.

    None where no side has room.
    """
    grown = submodel
    for side in range(6):
        buffer = list(grown.buffer)
        buffer[side] += BUFFERS[0]
        tried = replace(grown, buffer=tuple(buffer))
        if not any(_touches(tried, corners) for corners in avoid):
            grown = tried
    return None if grown == submodel else grown


def inside_evaluation_box(points: FloatArray, submodel: Submodel) -> BoolArray:
    """Points of the evaluation box, ``(n,)``."""
    gap = np.abs(points - np.asarray(submodel.centre)[:, None]).max(axis=0)
    return np.asarray(gap <= submodel.half)


def most_stressed_submodels(
    points: FloatArray,
    volumes: FloatArray,
    von_mises: dict[str, FloatArray],
    eligible: BoolArray,
    *,
    percentile: float,
    cells: CellMap | float,
    count: int,
    room: Room = Room(),
) -> tuple[Submodel, ...]:
    """Choose the cells with the highest stress percentile, none overlapping another.

    Returns tuple of Submodel: at most ``count``, the most stressed first.

    - ``points (3, M)``, mm: sample points of the driving analysis
    - ``volumes (M,)``, mm^3
    - ``von_mises``: by load case, each ``(M, q)``, MPa
    - ``eligible (M,)``: lattice outside the exclusion radius of supports and loads
    - ``percentile``: of the volume, per cent
    - ``cells``, mm: cells of a map, or the edge of cubes
    """
    if not eligible.any():
        return ()
    candidates: list[Submodel] = []
    position, volume = points[:, eligible], volumes[eligible]
    for name, field in von_mises.items():
        stress = field[eligible]
        for near in neighbourhoods(position, volume, cells):
            members = near.members
            value = weighted_percentile(
                stress[members].ravel(), shared_volumes(volume[members], stress), percentile
            )
            candidates.append(
                Submodel(
                    centre=near.centre,
                    half=near.edge / 2,
                    value=value,
                    load_case=name,
                    buffer=(room.buffer,) * 6,
                )
            )
    chosen: list[Submodel] = []
    for submodel in sorted(candidates, key=lambda submodel: -submodel.value):
        if any(_touches(submodel, corners) for corners in room.avoid):
            continue
        apart = all(
            np.abs(np.subtract(submodel.centre, other.centre)).max()
            >= 0.99 * (submodel.half + other.half)
            for other in chosen
        )
        if apart:
            chosen.append(submodel)
        if len(chosen) == count:
            break
    return tuple(chosen)


def _touches(submodel: Submodel, corners: FloatArray) -> bool:
    """Whether the box of any triangle meets the analysed box."""
    lower, upper = submodel_box(submodel)
    meets = (corners.min(axis=1) <= upper) & (corners.max(axis=1) >= lower)
    return bool(meets.all(axis=1).any())


def clip_surface(surface: SurfaceMesh, lower: FloatArray, upper: FloatArray) -> SurfaceMesh:
    """Cut a closed surface with a box; the result is closed.

    Raises MeshError if the surface cannot be cut or the box holds no material.
    """
    x, y, z = (float(s) for s in np.asarray(upper) - np.asarray(lower))
    box = box_surface((x, y, z))
    moved = SurfaceMesh(vertices=box.vertices + np.asarray(lower), faces=box.faces)
    return intersection(surface, moved, subject=f"submodel from {lower} to {upper} mm")


def cut_facets(
    points: FloatArray,
    facets: IntArray,
    lower: FloatArray,
    upper: FloatArray,
    tolerance: float,
) -> tuple[IntArray, IntArray]:
    """Boundary facets on the six planes of a submodel.

    Returns ``facets (j, 3)``; ``plane (j,)``: 0 to 5: x low, x high, y low, ...

    - ``points (3, n)``, mm
    - ``facets (k, 3)``
    - ``lower (3,)``, ``upper (3,)``, mm
    - ``tolerance``, mm
    """
    corners = points[:, facets]
    planes = np.full(len(facets), -1)
    for axis in range(3):
        for side, bound in enumerate((lower[axis], upper[axis])):
            on = np.abs(corners[axis] - bound).max(axis=1) <= tolerance
            planes[on] = 2 * axis + side
    chosen = planes >= 0
    return facets[chosen], planes[chosen]
