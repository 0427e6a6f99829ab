"""The field of a lattice for many samples of a regular grid, as layers are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gradedesign import (
    CellMap,
    LatticeDesign,
    NetSkin,
    StrutAxes,
    SurfaceDistance,
    cell_gradient,
    depths_of,
    lattice_field,
    solid_layers,
)
from gradedesign.fields import (
    BoolArray,
    Field,
    FloatArray,
    compiled_values,
    nearest_candidates,
)
from gradedesign_layers._strut_kernels import StrutArrays, fill_values
from gradedesign_layers._strut_pixel_kernels import fill_chosen, fill_solid
from gradedesign_layers.surface_band import surface_band

#: Bins along a cell in which the nearest struts are listed. Chosen, not measured.
_BINS = 32
#: Cubes that list triangles, by the distance of samples. Chosen, not measured.
_CUBES = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PixelPlane:
    """Centres of pixels in a plane of the machine.

    Attributes
    ----------
    frame : (3, 3) array
        Rows are the machine's axes.
    lower : (3,) array, mm
        Centre of the first pixel in these axes.
    pixel : float, mm
        Edge of a pixel.
    shape : (int, int)
        Pixels along the first two axes.
    """

    frame: FloatArray
    lower: FloatArray
    pixel: float
    shape: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PixelField:
    """A field evaluated in planes of pixels, by compiled code that other threads run beside.

    Attributes
    ----------
    solid : callable
        A plane to its pixels of negative value, ``(nx, ny)``.
    chosen : callable
        A plane and some of its pixels, ``(nx, ny)``, to the values there, row by row, ``(k,)`` mm.
    """

    solid: Callable[[PixelPlane], BoolArray]
    chosen: Callable[[PixelPlane, BoolArray], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DenseLattice:
    """Field of a lattice, right in sign everywhere and exact near its surface; called like one.

    Attributes
    ----------
    field : callable
        Points ``(3, n)`` mm to values ``(n,)``, about mm, negative inside.
    part : callable
        The same for the part alone: outside it never more than the distance to it.
    pixels : PixelField or None
        The same field in planes of pixels, where there is a faster way.
    """

    field: Field
    part: Field
    pixels: PixelField | None = None

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values ``(...)`` at points ``(3, ...)`` mm."""
        return self.field(points)


@lru_cache(maxsize=1)  # what measures the field and what samples it use the same one
def dense_lattice(design: LatticeDesign, reach: float) -> DenseLattice:
    """The field of a lattice for samples a third of a reach apart.

    Parameters
    ----------
    reach : float, mm
        Values are exact within this of the surface; of round struts in equal cells within one
        step of the samples. The sign is right everywhere.
    """
    if (fast := strut_lattice(design, reach / 3.0)) is not None:
        return fast
    part, _ = solid_layers(design.domain, reach)
    return DenseLattice(field=lattice_field(design, band=reach, single=True), part=part)


def strut_lattice(design: LatticeDesign, apart: float) -> DenseLattice | None:
    """A lattice of round struts of one density in equal cells, with a net-skin all round or none.

    Parameters
    ----------
    apart : float, mm
        Distance of two samples.

    Returns
    -------
    DenseLattice or None
        None where the lattice is of another kind.
    """
    domain, cell_map, axes = design.domain, design.cell_map, design.cells.axes
    if (
        axes is None
        or not isinstance(design.density, float | int)
        or not isinstance(cell_map, CellMap)
        or cell_map.inverse is None
        or not isinstance(domain.distance, SurfaceDistance)
        or len(domain.components) > 1
        or any(not isinstance(c, NetSkin) or c.faces is not None for c in domain.components)
    ):  # fmt: skip
        return None
    cells = _strut_arrays(design, axes, cell_map)
    # Of two samples on both sides of its surface both are nearer than this.
    exact = 1.01 * max(1.0, cells.steep) * apart
    thickness, depths = 0.0, np.zeros(0)
    for net in domain.of(NetSkin):
        thickness, depths = net.thickness, depths_of(net, design.cell_size)
    band = surface_band(
        domain.distance, _CUBES * apart, inner=thickness + 1.01 * exact, outer=1.01 * exact
    )

    lattice = (cells, band.arrays, thickness, exact, depths)

    def field(points: FloatArray) -> FloatArray:
        return compiled_values(fill_values, np.asarray(points, dtype=np.float64), *lattice)

    def solid(plane: PixelPlane) -> BoolArray:
        pixels = np.zeros(plane.shape, dtype=bool)
        fill_solid(*lattice, plane.frame, plane.lower, plane.pixel, pixels)
        return pixels

    def chosen(plane: PixelPlane, pixels: BoolArray) -> FloatArray:
        value = np.zeros(int(np.count_nonzero(pixels)))
        fill_chosen(*lattice, plane.frame, plane.lower, plane.pixel, pixels, value)
        return value

    return DenseLattice(field=field, part=band, pixels=PixelField(solid=solid, chosen=chosen))


def _strut_arrays(design: LatticeDesign, axes: StrutAxes, cell_map: CellMap) -> StrutArrays:
    """Struts and balls of a design in straight cells, as kernels take them."""
    balls = np.stack([axes.balls, axes.balls], axis=1) if axes.ball_ratio != 1.0 else ()
    segments = np.concatenate([axes.segments, np.reshape(balls, (-1, 2, 3))])
    thickness = np.ones(len(segments))
    thickness[len(axes.segments) :] = axes.ball_ratio
    near = nearest_candidates(segments, thickness, np.zeros((len(segments), 0, 3)), bins=_BINS)
    inverse = 1.0 / thickness[near.owner]
    corner = cell_map(np.zeros((3, 1)))[:, 0]
    matrix = np.ascontiguousarray(cell_map.jacobian(np.zeros((3, 1)))[:, :, 0])
    scale = design.cell_size / cell_gradient(design)
    return StrutArrays(
        near.bins,
        near.first.astype(np.int32),
        near.member.astype(np.int32),
        np.column_stack([near.start, near.axis, near.length, inverse]),
        matrix,
        np.asarray(-np.linalg.solve(matrix, corner), dtype=np.float64),
        scale,
        float(design.cells.level_of(np.asarray(design.density, dtype=np.float64))),
        scale * float(np.linalg.norm(matrix, 2)),
    )
