"""Density of a built lattice in slabs of one cell, beside the specified density."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, locked
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.contour._surface_kernels import volumes_under
from gradedesign.geometry.lattice.domain import LATTICE, phase_at
from gradedesign.geometry.lattice.lattice import LatticeDesign, density_at
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Points of the field per slab, and about the error of the share of a slab that they find.
_POINTS_PER_SLAB, FIELD_ERROR = 100_000, 1e-3
#: Points of the part's box where all slabs share them. Chosen, not measured.
_POINTS_IN_BOX = 1_000_000
#: Points that are evaluated at a time. Bounds the memory of one step; the result does not depend on
#: it. Chosen, not measured.
_BATCH = 1 << 18


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlabDensities:
    """Relative densities of slabs across one axis."""

    axis: int  #: 0, 1 or 2.
    edges: FloatArray  #: ``(n + 1,)``, mm. Planes between the slabs.
    part_volume: FloatArray  #: ``(n,)``, mm^3. Of the part in every slab.
    #: ``(n,)``. Mean of the specified density; skin and passive regions count as solid.
    target: FloatArray
    #: ``(n,)``. Share of the part inside the lattice's field, by evenly spread points.
    field: FloatArray
    surface: FloatArray  #: ``(n,)``. Volume of what is printed over that of the part.
    measured_on: str = "surface"  #: ``surface``, or ``layers`` where no surface was made.

    def __post_init__(self) -> None:
        for name in ("edges", "part_volume", "target", "field", "surface"):
            object.__setattr__(self, name, locked(getattr(self, name), (None,), name=name))


def total(slabs: SlabDensities, quantity: str) -> float:
    """Density of all slabs together; ``quantity`` is target, field or surface."""
    values: FloatArray = getattr(slabs, quantity)
    return float(slabs.part_volume @ values / slabs.part_volume.sum())


def slab_edges(low: float, high: float, thickness: float) -> FloatArray:
    """Planes a slab apart, from ``low``; a last slab thinner than half joins the one before.

    Examples
    --------
    >>> slab_edges(0.0, 24.0, 10.0)
    array([ 0., 10., 24.])
    """
    count = max(int(np.floor((high - low) / thickness + 0.5)), 1)
    edges = low + thickness * np.arange(count + 1, dtype=np.float64)
    edges[-1] = high
    return edges


def slab_density(
    design: LatticeDesign,
    lattice: Field,
    surface: SurfaceMesh,
    part: SurfaceMesh,
    *,
    axis: int,
    thickness: float,
    depth: Field | None = None,
) -> SlabDensities:
    """Measure the density of slabs.

    Raises LatticeError if the part has no volume in a slab.

    - ``lattice``: its field, trimmed by the part, with skin and passive regions
    - ``surface``: what is printed
    - ``part``: what it was cut from
    - ``axis``: across which slabs lie
    - ``thickness``, mm
    - ``depth``: distance of the part, right in sign and where skins end; by default that of the
      design
    """
    edges = slab_edges(
        float(design.domain.lower[axis]), float(design.domain.upper[axis]), thickness
    )
    whole = np.diff(volumes_below(part, axis, edges))
    if not (whole > 0).all():
        raise LatticeError(f"the part has no volume in {np.count_nonzero(whole <= 0)} slabs")
    printed = np.diff(volumes_below(surface, axis, edges))
    target = np.zeros(len(whole))
    share = np.zeros(len(whole))
    spread = spread_points(_POINTS_PER_SLAB)
    depth = design.domain.distance if depth is None else depth
    for n, (low, high) in enumerate(pairwise(edges)):
        lower, upper = np.array(design.domain.lower), np.array(design.domain.upper)
        lower[axis], upper[axis] = low, high
        target[n], share[n] = _means(
            design, lattice, depth, lower[:, None] + (upper - lower)[:, None] * spread
        )
    return SlabDensities(
        axis=axis,
        edges=edges,
        part_volume=whole,
        target=target,
        field=share,
        surface=printed / whole,
    )


class FieldPoints(NamedTuple):
    """Evenly spread points of a part."""

    target: FloatArray  #: ``(n,)``. Stated density, 1 in skins and passive regions.
    points: FloatArray  #: ``(3, n)``, mm.
    solid: BoolArray  #: ``(n,)``. Inside the field of the lattice.
    volume: float  #: mm^3. Of the field, by the share of points.


def field_points(design: LatticeDesign, fields: tuple[Field, Field]) -> FieldPoints:
    """Measure the fields of a lattice, trimmed by the part, and of the part at even points."""
    lattice, distance = fields
    lower, edges = design.domain.lower[:, None], design.domain.upper - design.domain.lower
    points = lower + edges[:, None] * spread_points(_POINTS_IN_BOX)
    depth = distance(points)
    points, depth = points[:, depth <= 0], depth[depth <= 0]
    lattices = phase_at(design.domain, points, depth) == LATTICE
    solid = np.asarray(lattice(points) <= 0)
    return FieldPoints(
        target=np.where(lattices, density_at(design, points), 1.0),
        points=points,
        solid=solid,
        volume=float(edges.prod() * np.count_nonzero(solid) / _POINTS_IN_BOX),
    )


def layered_density(
    design: LatticeDesign,
    field: FieldPoints,
    part: SurfaceMesh,
    printed: Sequence[tuple[FloatArray, FloatArray]],
    *,
    thickness: float,
) -> tuple[SlabDensities, ...]:
    """Density of slabs across x, y and z of a lattice that is built as layers, without a surface.

    Raises LatticeError if the part has no volume in a slab, or no point was found there.

    ``printed``: middles of thin slices across each axis, ``(k,)``, mm, and the volume printed in
    them, ``(k,)``, mm^3; a slice counts for the slab of its middle. ``thickness``, mm: of a slab.
    """
    slabs = []
    for axis, (middles, volumes) in enumerate(printed):
        edges = slab_edges(
            float(design.domain.lower[axis]), float(design.domain.upper[axis]), thickness
        )
        whole = np.diff(volumes_below(part, axis, edges))
        at = np.clip(
            np.searchsorted(edges, field.points[axis], side="right") - 1, 0, len(whole) - 1
        )
        count = np.bincount(at, minlength=len(whole))
        if not (whole > 0).all() or not count.all():
            empty = np.count_nonzero((whole <= 0) | (count == 0))
            raise LatticeError(f"no point of the part was found in {empty} slabs")
        slab = np.clip(np.searchsorted(edges, middles, side="right") - 1, 0, len(whole) - 1)
        slabs.append(
            SlabDensities(
                axis=axis,
                edges=edges,
                part_volume=whole,
                target=np.bincount(at, weights=field.target, minlength=len(whole)) / count,
                field=np.bincount(at, weights=field.solid, minlength=len(whole)) / count,
                surface=np.bincount(slab, weights=volumes, minlength=len(whole)) / whole,
                measured_on="layers",
            )
        )
    return tuple(slabs)


def volumes_below(surface: SurfaceMesh, axis: int, planes: FloatArray) -> FloatArray:
    """Volume of a closed surface below planes across an axis, ``(k,)``, mm^3.

    Exact: by the divergence theorem the volume below ``c`` is the integral of ``min(x, c) n_x``
    over the surface, and on a triangle that integrand is piecewise linear.

    ``surface``: closed and outward oriented. ``planes (k,)``, mm.
    """
    middle = float(surface.vertices[:, axis].mean())  # so that large coordinates cancel
    return volumes_under(
        surface.vertices, surface.faces, axis, np.asarray(planes, dtype=np.float64), middle
    )


def _means(
    design: LatticeDesign, lattice: Field, distance: Field, points: FloatArray
) -> tuple[float, float]:
    """Mean target and share of the lattice over the points ``(3, n)`` that lie in the part."""
    inside, solid, target = 0, 0, 0.0
    for start in range(0, points.shape[1], _BATCH):
        batch = points[:, start : start + _BATCH]
        depth = distance(batch)
        batch, depth = batch[:, depth <= 0], depth[depth <= 0]
        if not batch.size:
            continue
        lattices = phase_at(design.domain, batch, depth) == LATTICE
        wanted = np.where(lattices, density_at(design, batch), 1.0)
        inside += batch.shape[1]
        solid += int(np.count_nonzero(lattice(batch) <= 0))
        target += float(wanted.sum())
    if inside == 0:
        raise LatticeError(
            f"no point of the part was found between {points.min(axis=1).tolist()} and "
            f"{points.max(axis=1).tolist()} mm"
        )
    return target / inside, solid / inside


def slab_table(slabs: Sequence[SlabDensities]) -> str:
    """One line per slab, comma separated, units in the header."""
    lines = [f"axis,from_mm,to_mm,part_mm3,target,field,{slabs[0].measured_on}"]
    for s in slabs:
        for n in range(len(s.target)):
            numbers = (
                *(s.edges[n], s.edges[n + 1], s.part_volume[n]),
                *(s.target[n], s.field[n], s.surface[n]),
            )
            lines.append(",".join(["xyz"[s.axis], *(f"{v:.6g}" for v in numbers)]))
    return "\n".join(lines) + "\n"
