"""Voids of the printed solid: those that powder cannot leave, and the throats of the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, generate_binary_structure, label

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.design.printing._void_kernels import FAR, distances_along, widest_ways
from gradedesign.geometry.contour._surface_kernels import shell_volumes, vertex_shells
from gradedesign.geometry.triangles.grid_classifier import VoxelGrid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

_Levels: TypeAlias = NDArray[np.integer[Any]]

#: Grid steps across the narrowest throat that is told from a closed one, at least: widths are right
#: within one and a half steps.
STEPS_PER_THROAT = 8.0
#: Memory of a voxel while the ways out are found.
BYTES_PER_VOXEL = 26
#: Levels of width in a grid step. Chosen, not measured.
_PER_STEP = 8
#: A voxel whose centre is this far beyond a ball, in steps, touches it: half of its diagonal, and
#: half a step between the centres of balls.
_TOUCH = 1.4
#: Smaller voids are below the grid, voxels. Chosen, not measured.
_LEAST_VOXELS = 8
#: Percentiles of the volume by the throats that lead to it, %, and how often each is halved.
#: Chosen, not measured.
_PERCENTILES = (5.0, 50.0)
#: Widths are found to 2^-7 of the widest throat. Chosen, not measured.
_HALVINGS = 7
#: Trapped voids that are described, from the largest. Chosen, not measured.
_LISTED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class TrappedVoid:
    """A void that powder cannot leave."""

    volume_mm3: float
    at_mm: tuple[float, float, float]  #: Where it is widest.
    way_mm: float  #: Diameter of the largest ball that leaves it; 0 where none does.
    throat_mm: tuple[float, float, float] | None  #: Narrowest place of that way.


@dataclass(frozen=True, slots=True, kw_only=True)
class Voids:
    """Voids inside the part's outline."""

    step_mm: float  #: Grid. Widths are right within one and a half steps.
    volume_mm3: float  #: Of all voids.
    closed: int  #: Voids without any way out, by the surface itself.
    closed_volume_mm3: float
    min_throat_mm: float | None  #: Narrowest throat through which powder leaves; None: any does.
    trapped_volume_mm3: float  #: Closed, or behind narrower throats by more than their width.
    trapped: tuple[TrappedVoid, ...]  #: The largest.
    #: That share of the voids' volume, in per cent, is not reached by a larger ball from outside.
    pore_throat_percentiles_mm: Mapping[str, float] = field(default_factory=dict)


def measure_voids(
    surface: SurfaceMesh,
    solid: BoolArray,
    outline: BoolArray,
    grid: VoxelGrid,
    min_throat: float | None,
) -> Voids:
    """Find the voids that powder cannot leave, and the width of the ways out of the others.

    The way out of a place is the one on which the smallest distance from the solid is largest; its
    width is twice that. Powder leaves through throats of ``min_throat``: what a ball of that size
    reaches from outside, and corners behind it as deep as the ball is wide, are free.

    - ``surface``: the printed solid, closed
    - ``solid (nx, ny, nz)``: its voxels, with an empty margin wider than half of ``min_throat``
    - ``outline (nx, ny, nz)``: voxels of the fully solid part
    - ``min_throat``, mm

    References
    ----------
    Pore throats by the volume that a ball reaches from outside: B. Muench, L. Holzer,
    "Contradicting geometrical concepts in pore size analysis attained with electron microscopy and
    mercury intrusion", J. Am. Ceram. Soc. 91 (2008).
    """
    h = grid.step
    level = np.zeros(solid.shape, dtype=np.uint16)
    level[...] = np.minimum(_PER_STEP * np.sqrt(_squared(solid)), 65534.0)
    way = np.zeros(solid.shape, dtype=np.uint16)
    throat = np.zeros(solid.shape, dtype=np.int32)
    widest_ways(level, way, throat)
    voids = outline & ~solid
    closed, closed_volume = _closed_voids(surface)
    if min_throat is None:
        stuck = voids & (way == 0)
    else:
        stuck = _behind_throats(solid, way, h, min_throat) & voids
    count, labels = _components(stuck)
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * h**3
    ways = np.zeros(count + 1)
    largest: list[TrappedVoid] = []
    boxes = find_objects(labels)
    for n in (np.argsort(-sizes[1:], kind="stable") + 1).tolist():
        box = boxes[n - 1]
        inside = np.where(labels[box] == n, level[box], 0)
        index = np.array(np.unravel_index(int(np.argmax(inside)), inside.shape))
        index += np.array([part.start for part in box])
        here = tuple(index.tolist())
        ways[n] = _width(way[here], h)
        if len(largest) < _LISTED and sizes[n] >= _LEAST_VOXELS * h**3:
            largest.append(_trapped_void(grid, here, float(sizes[n]), float(ways[n]), throat))
    real = sizes >= _LEAST_VOXELS * h**3
    real[0] = False
    sealed = float(sizes[real & (ways == 0)].sum())
    trapped = float(sizes[real & (ways > 0)].sum()) + max(sealed, closed_volume)
    return Voids(
        step_mm=h,
        volume_mm3=float(np.count_nonzero(voids)) * h**3,
        closed=closed,
        closed_volume_mm3=closed_volume,
        min_throat_mm=min_throat,
        trapped_volume_mm3=closed_volume if min_throat is None else trapped,
        trapped=tuple(largest),
        pore_throat_percentiles_mm=_throats(voids, way, h),
    )


def _width(way: int, h: float) -> float:
    """Diameter of the ball of a level, mm."""
    return 2.0 * float(way) / _PER_STEP * h


def _squared(chosen: BoolArray) -> FloatArray:
    """Squared distance to chosen voxels, in voxels."""
    values = np.where(chosen, np.float32(0.0), np.float32(FAR))
    for axes in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
        turned = values.transpose(axes)
        in_ranges(distances_along, range(len(turned)), turned)
    return values


def _reached(way: _Levels, h: float, width: float) -> BoolArray:
    """Voxels that a ball of a diameter covers on its way from outside, or touches."""
    centres = way >= np.ceil(_PER_STEP * 0.5 * width / h - 1e-6)
    return np.asarray(_squared(centres) <= (0.5 * width / h + _TOUCH) ** 2)


def _behind_throats(solid: BoolArray, way: _Levels, h: float, width: float) -> BoolArray:
    """Voids farther, through the voids, than a throat's width from where a ball of it comes."""
    air = ~solid
    free = binary_dilation(
        _reached(way, h, width) & air,
        structure=generate_binary_structure(3, 2),
        iterations=int(np.ceil(width / h)),
        mask=air,
    )
    return np.asarray(air & ~free)


def _components(chosen: BoolArray) -> tuple[int, _Levels]:
    labels, count = label(chosen)
    return count, labels


def _trapped_void(
    grid: VoxelGrid, here: tuple[int, ...], volume: float, width: float, throat: _Levels
) -> TrappedVoid:
    neck = np.unravel_index(int(throat[here]), throat.shape) if width > 0 else None
    return TrappedVoid(
        volume_mm3=volume,
        at_mm=grid.place(np.array(here)),
        way_mm=width,
        throat_mm=None if neck is None else grid.place(np.array(neck)),
    )


def _closed_voids(surface: SurfaceMesh) -> tuple[int, float]:
    """Closed voids of a surface and their volume, mm^3: its shells that are turned inward."""
    shell = vertex_shells(surface.faces, len(surface.vertices))
    count = int(shell.max()) + 1
    volume = np.asarray(shell_volumes(surface.vertices, surface.faces, shell, count))
    return int(np.count_nonzero(volume < 0)), float(np.abs(volume[volume < 0]).sum())


def _throats(voids: BoolArray, way: _Levels, h: float) -> dict[str, float]:
    """Percentiles of the throats through which the voids' volume is reached, mm."""
    total = np.count_nonzero(voids)
    throats: dict[str, float] = {}
    for percentile in _PERCENTILES if total else ():
        # A ball that reaches less than the rest is too large.
        low, high = 0.0, _width(int(way[voids].max()), h)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            share = np.count_nonzero(voids & _reached(way, h, middle)) / total
            low, high = (low, middle) if 100.0 * (1.0 - share) > percentile else (middle, high)
        throats[f"{percentile:g}"] = 0.5 * (low + high)
    return throats
