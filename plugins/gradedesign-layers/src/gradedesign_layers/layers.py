"""Layers of a print, sampled from the field a few at a time: which pixels are solid.

Memory holds the values of these, and of every layer its runs of solid pixels and the values
beside their ends. Disconnected components are looked for across the layers and left out, as the
printed surface leaves them. Where no surface is made the layers are compared with the field.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from gradedesign import (
    LatticeError,
    PlannedPrint,
    PrintedLattice,
    checked_values,
    in_threads,
    report_step,
)
from gradedesign.fields import BoolArray, Field, FloatArray
from gradedesign_layers import _run_kernels as kernels
from gradedesign_layers._tile_kernels import place_tiles, tile_points
from gradedesign_layers.dense_lattice import DenseLattice, PixelField, PixelPlane, dense_lattice
from gradedesign_layers.layer_contours import contour_volume
from gradedesign_layers.layer_stack import Layer, Layers

#: Largest relative difference of the layers' volume from the surface's: pixels and layers are not
#: as fine as its triangles, but nothing is missing.
VOLUME_TOLERANCE = 0.02
#: Times that a pixel which nobody stated is halved: a quarter of the layer height takes 16 times
#: the samples, and what is still off then is not the doing of pixels.
HALVINGS = 2
#: Points that the field gets at a time.
_BATCH = 1 << 20
#: Pixels along the edge of the tiles that are left out where they lie outside the part.
_TILE = 4


def why_no_layers(planned: PlannedPrint | PrintedLattice) -> str:
    """Why a lattice cannot be written in layers; empty where it can."""
    if planned.layer_height is None:
        return 'layers need their height; state [print] layer_height = "0.03 mm"'
    return ""


def _require_printer(lattice: PrintedLattice) -> tuple[float, float]:
    """Layer height and pixel, mm.

    Raises
    ------
    LatticeError
        If the case states no layer height.
    """
    if words := why_no_layers(lattice):
        raise LatticeError(words)
    if lattice.layer_height is None or lattice.field is None:
        raise LatticeError("the lattice comes without a field to sample")
    return lattice.layer_height, lattice.pixel_size or lattice.layer_height


def slice_lattice(lattice: PrintedLattice, *, contoured: bool = False) -> Layers:
    """Sample the layers of a lattice.

    Where no pixel is stated it is the layer height, or a half or a quarter of it where the layers
    do not hold the volume of the surface otherwise: walls that lie along rows of pixels gain or
    lose a whole row. Without a surface they are to hold the volume of the field, by evenly spread
    points, with what is left out as disconnected. ``contoured``: contours between the pixels are
    what is printed, and suffice where they hold the volume; thin struts lose more as pixels.

    Raises
    ------
    LatticeError
        If there is no printer, or the layers do not hold what is meant.
    """
    if isinstance(lattice.sampled, Layers):
        return lattice.sampled
    height, pixel = _require_printer(lattice)
    stated = lattice.measured
    meant = lattice.volume
    for left in range(0 if lattice.pixel_size else HALVINGS, -1, -1):
        layers = _slice_at(lattice, height, pixel)
        # Printed surfaces lack the disconnected components as the layers do; the field has them.
        kept = 1.0 if stated is None else 1.0 - layers.dropped_share
        near = VOLUME_TOLERANCE * meant
        if contoured and abs(layers.volume / kept - meant) > near:
            layers = replace(layers, contour_volume=contour_volume(layers))
        volume = layers.printed_volume / kept
        if abs(volume - meant) <= near:
            return layers
        pixel *= 0.5 if left else 1.0
    what = "printed surface" if stated is None else "field of the lattice"
    raise LatticeError(
        f"layers of {height:g} mm with pixels of {pixel:g} mm hold {volume:.4g} mm^3, the "
        f"{what} {meant:.4g} mm^3; expected the same within "
        f"{100 * VOLUME_TOLERANCE:g} %: state a smaller [print] layer_height or pixel_size"
    )


def _slice_at(lattice: PrintedLattice, height: float, pixel: float) -> Layers:
    """Layers of a lattice at one size of the pixels, mm, whatever volume they hold."""
    frame = lattice.frame
    corners = lattice.bounds @ frame.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    nx, ny = (int(n) + 2 for n in np.ceil((high - low)[:2] / pixel - 1e-9))
    count = max(1, int(np.ceil((high - low)[2] / height - 1e-9)))
    layers = Layers(
        frame=frame,
        lower=np.array([low[0] - 0.5 * pixel, low[1] - 0.5 * pixel, low[2]]),
        shape=(nx, ny),
        pixel=pixel,
        height=height,
        layers=(),
    )
    field = _dense_field(lattice, pixel)
    if isinstance(field, DenseLattice) and field.pixels is not None:
        return _connected(layers, _by_pixels(layers, field.pixels, count), lattice.bodies)
    return _connected(layers, map(_layer, _sampled(layers, field, count)), lattice.bodies)


def _dense_field(lattice: PrintedLattice, pixel: float) -> Field:
    """The field of a lattice for sampling in steps of a pixel."""
    if lattice.design is not None:
        return dense_lattice(lattice.design, 3.0 * pixel)
    if lattice.field is None:
        raise LatticeError("the lattice comes without a field")
    return lattice.field


def _by_pixels(layers: Layers, field: PixelField, count: int) -> Iterator[Layer]:
    """Layers of a field that is evaluated in planes of pixels, many at a time."""
    frame = np.ascontiguousarray(layers.frame)

    def layer(number: int) -> Layer:
        lower = np.array([*layers.lower[:2], layers.top(number) - 0.5 * layers.height])
        plane = PixelPlane(frame=frame, lower=lower, pixel=layers.pixel, shape=layers.shape)
        solid = field.solid(plane)
        near = _changing(solid)
        return _runs(solid, field.chosen(plane, near))

    for number, made in enumerate(in_threads(layer, range(count))):
        report_step("layers", number / count)
        yield made


def _sampled(layers: Layers, field: Field, count: int) -> Iterator[FloatArray]:
    """Field at the centres of the pixels half-way up every layer, ``(nx, ny)``, above 0 far away.

    Tiles of pixels that lie outside the part are left out.
    """
    nx, ny = layers.shape
    tiles = ((nx + _TILE - 1) // _TILE, (ny + _TILE - 1) // _TILE)
    middles = np.stack(np.meshgrid(*map(np.arange, tiles), indexing="ij")).reshape(2, -1)
    centres = layers.lower[:2, None] + layers.pixel * (_TILE * middles + 0.5 * (_TILE - 1))
    # The neighbours of solid pixels are evaluated too.
    beyond = (0.5 * 2.0**0.5 * (_TILE - 1) + 1.01) * layers.pixel
    every = np.ones(tiles, dtype=bool)
    for number in range(count):
        report_step("layers", number / count)
        z = layers.top(number) - 0.5 * layers.height
        chosen = every
        if isinstance(field, DenseLattice):
            places = np.concatenate([centres, np.full((1, centres.shape[1]), z)])
            chosen = (field.part(layers.frame.T @ places) <= beyond).reshape(tiles)
        points = np.zeros((3, _TILE**2 * int(np.count_nonzero(chosen))))
        filled = tile_points(chosen, _TILE, layers.shape, layers.pixel, points)
        points = points[:, :filled]
        points[:2] += layers.lower[:2, None]
        points[2] = z
        values = np.full(layers.shape, np.inf)
        place_tiles(chosen, _TILE, _values(field, layers.frame, points), values)
        yield values


def _values(field: Field, frame: FloatArray, points: FloatArray) -> FloatArray:
    values = np.zeros(points.shape[1])
    for low in range(0, len(values), _BATCH):
        part = slice(low, low + _BATCH)
        values[part] = checked_values(field, frame.T @ points[:, part])
    return values


def _connected(empty: Layers, sampled: Iterable[Layer], bodies: int) -> Layers:
    """The layers with the largest components alone, as many as there are bodies."""
    runs: list[Layer] = []
    base = [0]
    parent = np.arange(1 << 16, dtype=np.int32)
    none = (np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int32), 0)
    for layer in sampled:
        runs.append(layer)
        base.append(base[-1] + len(layer.ends))
        if base[-1] > len(parent):
            more = np.arange(len(parent), max(2 * len(parent), base[-1]), dtype=np.int32)
            parent = np.concatenate([parent, more])
        below = none if len(runs) == 1 else (runs[-2].first, runs[-2].ends, base[-3])
        kernels.join_runs(parent, layer.first, layer.ends, base[-2], *below)
    parent = parent[: base[-1]]
    if not len(parent):
        raise LatticeError("no pixel of any layer is solid; state a smaller [print] pixel_size")
    kernels.flatten(parent)
    length = np.concatenate([layer.ends[:, 1] - layer.ends[:, 0] for layer in runs])
    volume = np.bincount(parent, weights=length, minlength=len(parent))
    count = int(np.count_nonzero(volume))
    if count <= bodies:
        return replace(empty, layers=tuple(runs))
    largest = np.zeros(len(parent), dtype=bool)
    largest[np.argsort(-volume, kind="stable")[:bodies]] = True
    in_largest = largest[parent]

    def largest_of(number: int) -> Layer:
        own = in_largest[base[number] : base[number + 1]]
        return runs[number] if own.all() else _thinned(runs[number], own, empty.shape[1])

    share = 1.0 - float(volume[largest].sum() / volume.sum())
    kept = tuple(in_threads(largest_of, range(len(runs))))
    return replace(empty, layers=kept, dropped=count - bodies, dropped_share=share)


def _layer(values: FloatArray) -> Layer:
    """Runs of a sampled layer, and its values beside their ends."""
    solid = values < 0.0
    return _runs(solid, values[_changing(solid)])


def _runs(solid: BoolArray, beside: FloatArray) -> Layer:
    """A layer of solid pixels and the values where they change."""
    first = np.zeros(len(solid) + 1, dtype=np.int64)
    ends = np.zeros((kernels.row_runs(solid, first, np.zeros((0, 2), dtype=np.int32)), 2),
                    dtype=np.int32)  # fmt: skip
    kernels.row_runs(solid, first, ends)
    return Layer(first=first, ends=ends, beside=beside.astype(np.float32))


def _changing(solid: BoolArray) -> BoolArray:
    """Pixels with a neighbour that is not as they are."""
    near = np.zeros(solid.shape, dtype=bool)
    kernels.beside_change(solid, near)
    return near


def _thinned(layer: Layer, held: BoolArray, ny: int) -> Layer:
    """A layer with some of its runs, whole components of it."""
    before = np.concatenate([[0], np.cumsum(held)])
    thinner = Layer(first=before[layer.first], ends=layer.ends[held], beside=layer.beside)
    old, new = _changing(layer.solid(ny)), _changing(thinner.solid(ny))
    return replace(thinner, beside=layer.beside[new[old]])
