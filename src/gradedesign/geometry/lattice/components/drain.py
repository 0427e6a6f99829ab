"""Drain holes: at stated places, or one for every void that nothing else opens."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy import ndimage

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, lock
from gradedesign.common.system.progress import report_step
from gradedesign.errors import CaseError, LatticeError, ResourceError
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.lattice.component import KEPT, CutComponent
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.part.place import face_places
from gradedesign.geometry.part.signed_distance import region_distance

#: Depths along a drain, per radius, at which a void is looked for. Chosen, not measured.
_PER_RADIUS = 8
#: A mouth's rim may leave the surface by this share of its radius. Chosen, not measured.
_RIM = 0.2
#: A stated place may lie this many radii off the surface. Chosen, not measured.
_OFF = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drain(CutComponent):
    """A hole along a straight axis, with a round bottom.

    Raises `LatticeError` if radius or depth are not positive.
    """

    mouth: FloatArray  #: ``(3,)``, mm. On the part's surface.
    inward: FloatArray  #: ``(3,)``. Unit direction of the axis.
    radius: float  #: mm.
    depth: float  #: mm. Of the axis below the mouth; the bottom reaches a radius deeper.

    listed: ClassVar[str] = "drains"

    def __post_init__(self) -> None:
        lock(self, mouth=(3,), inward=(3,))
        if not (self.radius > 0 and self.depth > 0):
            raise LatticeError(
                f"a drain hole of radius {self.radius:g} mm and depth {self.depth:g} mm is "
                f"impossible; expected both above 0 mm"
            )

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to the hole at points ``(3, ...)`` mm, ``(...)``, mm, negative in it.

        It goes on for a radius outside the part, so that a curved mouth is open all round.
        """
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1) - self.mouth[:, None]
        along = np.clip(self.inward @ flat, -self.radius, self.depth)
        away = np.linalg.norm(flat - self.inward[:, None] * along, axis=0)
        return np.asarray(away - self.radius).reshape(np.shape(points)[1:])

    @property
    def facts(self) -> Mapping[str, Any]:
        """Mouth, direction, diameter and depth, which includes the round bottom."""
        return {
            "mouth_mm": self.mouth.tolist(),
            "inward": self.inward.tolist(),
            "diameter_mm": 2 * self.radius,
            "depth_mm": self.depth + self.radius,
        }


def _make(place: ComponentPlace) -> Made:
    """Drain holes of a case, and remarks on voids that stay closed or were not there.

    Raises CaseError if a stated place is off the surface or above no void, or a void can be reached
    nowhere. Raises ResourceError if voids are to be found in too many cells.
    """
    spec, design = place.lattice.drain, place.design
    if spec is None or design is None:
        return (), ()
    radius, where = spec.diameter / 2, place.where("lattice.drain")
    # What a ball of the hole's diameter does not fill is left as it is.
    least = 4 / 3 * np.pi * radius**3
    report_step("voids without a way out")
    before = closed_voids(design, place.cell_edge, least)
    drains = [
        _stated(place.where(f"lattice.drain.at[{n}]"), at, radius, design)
        for n, at in enumerate(spec.at)
    ] or [_placed(place, radius, design, before, n + 1) for n in range(len(before.volumes))]
    if not drains:
        return (), (f"{where}: no void is closed, so no hole was made",)
    holed = replace(design, domain=design.domain.with_components(drains))
    closed = sorted(closed_voids(holed, place.cell_edge, least).volumes.tolist(), reverse=True)
    if not closed:
        return drains, ()
    sizes = ", ".join(f"{volume:.4g}" for volume in closed[:5])
    return drains, (
        f"{where}: {len(closed)} voids have no way out, of {sizes} mm^3 and so on: powder stays "
        f"there; state more places in at, or a smaller diameter",
    )


def _stated(where: str, place: tuple[float, ...], radius: float, design: LatticeDesign) -> Drain:
    """Hole at a stated place, along the normal there, down to the first void."""
    at = np.array(place)[:, None]
    distance = float(design.domain.distance(at)[0])
    if abs(distance) > _OFF * radius:
        raise CaseError(
            f"{where}: found a place {abs(distance):.3g} mm off the part's surface; expected one "
            f"on it, within {_OFF * radius:g} mm"
        )
    # A little inside, where the normal of a face is not that of its rim.
    outward = gradient(design.domain.distance, at, 1e-4)[:, 0]
    outward /= np.linalg.norm(outward)
    mouth = at[:, 0] - distance * outward
    depths = _depths(radius, design)
    field = lattice_field(design)
    free = field(mouth[:, None] - depths * outward[:, None]) > 0
    if not free.any():
        raise CaseError(
            f"{where}: there is no void within {depths[-1]:.3g} mm below "
            f"({mouth[0]:.4g}, {mouth[1]:.4g}, {mouth[2]:.4g}) mm; expected a place above one"
        )
    depth = float(depths[int(np.argmax(free))])
    return Drain(mouth=mouth, inward=-outward, radius=radius, depth=depth)


def _placed(
    place: ComponentPlace, radius: float, design: LatticeDesign, voids: ClosedVoids, number: int
) -> Drain:
    """Hole into one void from a free and even place of the surface, where it is widest."""
    points, inward = face_places(place.part)
    free = _free(place, radius, points)
    points, inward = points[:, free], inward[:, free]
    depths = _depths(radius, design)
    reached = np.full(points.shape[1], np.inf)
    for depth in depths[::-1]:
        hit = void_at(voids, points + depth * inward) == number
        reached[hit] = depth
    reachable = np.flatnonzero(np.isfinite(reached))
    points, inward, reached = points[:, reachable], inward[:, reachable], reached[reachable]
    # The bottom of the hole lies free in the void where that is possible.
    bottom = lattice_field(design)(points + (reached + radius) * inward)
    room = np.where(bottom > 0, np.minimum(bottom, radius), 0.0)
    for at in np.lexsort((reached, -np.round(room, 2))):
        if _even(design.domain.distance, points[:, at], inward[:, at], radius):
            return Drain(
                mouth=points[:, at],
                inward=inward[:, at],
                radius=radius,
                depth=float(reached[at]),
            )
    raise CaseError(
        f"{place.where('lattice.drain')}: no even place of {2 * radius:g} mm away from held, "
        f"loaded and passive regions leads to the closed void of "
        f"{voids.volumes[number - 1]:.4g} mm^3 within {depths[-1]:.3g} mm; expected a smaller "
        f"diameter, or places in at"
    )


def _depths(radius: float, design: LatticeDesign) -> FloatArray:
    """Depths below the surface at which a void is looked for, mm."""
    domain = design.domain
    closed = max((solid.thickest for solid in domain.solids if solid.closes), default=0.0)
    joint = 0.0 if domain.join is None else domain.join.radius
    reach = closed + joint + design.cell_size
    return np.arange(1, np.ceil(_PER_RADIUS * reach / radius) + 1) * radius / _PER_RADIUS


def _free(place: ComponentPlace, radius: float, points: FloatArray) -> BoolArray:
    """Whether mouths lie off every region that the case holds, loads or keeps solid, ``(n,)``."""
    free = np.ones(points.shape[1], dtype=bool)
    for name in place.loaded:
        free &= region_distance(place.part.regions[name].corners)(points) > radius
    to_part = np.zeros(points.shape[1])
    for solid in place.domain.solids:
        if solid.phase == KEPT:
            free &= solid.distance(points, to_part) > radius
    return free


def _even(distance: Field, mouth: FloatArray, inward: FloatArray, radius: float) -> bool:
    """Whether the rim of a mouth lies on the surface."""
    across = np.linalg.svd(inward[None])[2][1:]
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    # With room for the rim: half a radius around the hole.
    rim = mouth[:, None] + 1.5 * radius * (across.T @ np.stack([np.cos(angles), np.sin(angles)]))
    return bool((np.abs(distance(rim)) <= _RIM * radius).all())


#: Holes by which powder leaves, ``drain = {diameter = "3 mm"}``.
KIND = ComponentKind(name="drain", stage="cut", make=_make)


#: Voxels along a cell, and how much larger they may be where the part is large. None is larger
#: than a skin is thick, so that none leaks.
PER_CELL, _COARSER = 16.0, 1.5
#: Most voxels of a grid. Chosen, not measured.
MOST_VOXELS = 12_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosedVoids:
    """Voids without a way out of the part."""

    #: ``(nx, ny, nz)``. Number of the void that each voxel lies in, from 1; 0 elsewhere.
    label: IntArray
    #: ``(n,)``, mm^3. Of the voids, those of voxels more than half a voxel from the solid.
    volumes: FloatArray
    lower: FloatArray  #: ``(3,)``, mm. Centre of the first voxel.
    spacing: float  #: mm.

    def __post_init__(self) -> None:
        lock(self, volumes=(None,), lower=(3,))


def closed_voids(design: LatticeDesign, cell: float, least: float) -> ClosedVoids:
    """Voids of at least a volume that touch no open face of the part.

    Voxels count as void more than half a voxel from the solid: no wall is too thin to part two of
    them, and throats narrower than a voxel count as closed.

    Raises ResourceError if the grid would be too large.

    ``cell``, mm: shortest edge of a cell. ``least``, mm^3: smaller voids are left out.
    """
    domain = design.domain
    edges = domain.upper - domain.lower
    wished = min([cell / PER_CELL, *(solid.least for solid in domain.solids if solid.closes)])
    spacing = max(wished, float((edges.prod() / MOST_VOXELS) ** (1 / 3)))
    if spacing > wished * _COARSER:
        raise ResourceError(
            f"finding closed voids among {edges.prod() / cell**3:.3g} cells takes more than "
            f"{MOST_VOXELS:g} voxels of {wished:.3g} mm; name the places of drain holes in at"
        )
    # A layer of voxels lies outside the part all round.
    lower = domain.lower - 1.5 * spacing
    nx, ny, nz = (int(n) + 4 for n in np.ceil(edges / spacing))
    shape = (nx, ny, nz)
    field, part = lattice_field(design, band=2 * spacing), solid_layers(domain, 2 * spacing)[0]
    void, outside = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    for i in range(nx):
        points = grid_points(lower, (i, 0, 0), (1, ny, nz), spacing)
        outside[i] = part(points)[0] >= 0
        void[i] = field(points)[0] > 0.5 * spacing
    label, count = ndimage.label(void & ~outside)
    beside = ndimage.binary_dilation(outside) & ~outside
    opened = np.unique(label[beside])
    volumes = spacing**3 * np.bincount(label.ravel(), minlength=count + 1).astype(np.float64)
    closed = [n for n in range(1, count + 1) if n not in set(opened.tolist())]
    kept = [n for n in closed if volumes[n] >= least]
    number = np.zeros(count + 1, dtype=np.int64)
    number[kept] = 1 + np.arange(len(kept))
    return ClosedVoids(label=number[label], volumes=volumes[kept], lower=lower, spacing=spacing)


def void_at(voids: ClosedVoids, points: FloatArray) -> IntArray:
    """Number of the closed void at points ``(3, n)`` mm, ``(n,)``, 0 elsewhere."""
    index = np.rint((points - voids.lower[:, None]) / voids.spacing).astype(np.int64)
    shape = np.array(voids.label.shape)[:, None]
    inside = ((index >= 0) & (index < shape)).all(axis=0)
    numbers = np.zeros(points.shape[1], dtype=np.int64)
    numbers[inside] = voids.label[tuple(index[:, inside])]
    return numbers
