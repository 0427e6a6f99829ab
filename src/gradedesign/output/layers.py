"""Layers of a print, sampled from the field one at a time: which pixels are solid.

Memory holds the values of one layer, and of every layer its pixels as compressed bits. Components
that hang in the air are found across the layers and left out, as the printed surface leaves them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import label

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, locked
from gradedesign.case.print_schema import FRAMES
from gradedesign.errors import LatticeError
from gradedesign.lattice.sample import checked_values
from gradedesign.mesh.surface_mesh import enclosed_volume
from gradedesign.output.printed_lattice import PrintedLattice
from gradedesign.workspace.progress import report_step

#: Largest relative difference of the layers' volume from the surface's: pixels and layers are not
#: as fine as its triangles, but nothing is missing.
VOLUME_TOLERANCE = 0.02
#: Times that a pixel which nobody stated is halved: a quarter of the layer height takes 16 times
#: the samples, and what is still off then is not the doing of pixels.
HALVINGS = 2
#: Points that the field gets at a time.
_BATCH = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layers:
    """Layers of a lattice in the axes of the machine.

    Attributes
    ----------
    frame : (3, 3) array
        Rows are the machine's axes; its origin is the part's.
    lower : (3,) array, mm
        Centre of the first pixel, and underside of the first layer.
    shape : (int, int)
        Pixels along x and y; the outer ones are empty.
    pixel, height : float, mm
        Edge of a pixel, and thickness of a layer.
    bits : tuple of bytes
        Solid pixels of every layer, packed and compressed.
    """

    frame: FloatArray
    lower: FloatArray
    shape: tuple[int, int]
    pixel: float
    height: float
    bits: tuple[bytes, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", locked(self.frame, (3, 3), name="frame"))
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))

    def top(self, number: int) -> float:
        """Upper side of a layer, mm; of -1, the underside of the first."""
        return float(self.lower[2] + (number + 1) * self.height)

    def solid(self, number: int) -> BoolArray:
        """Solid pixels of a layer, ``(nx, ny)``."""
        return _unpacked(self.bits[number], self.shape)

    def values(self, number: int, field: Field, chosen: BoolArray) -> FloatArray:
        """Field at the centres of chosen pixels half-way up a layer, ``(k,)``."""
        place = np.argwhere(chosen).T * self.pixel
        points = np.stack(
            [
                self.lower[0] + place[0],
                self.lower[1] + place[1],
                np.full(place.shape[1], self.top(number) - 0.5 * self.height),
            ]
        )
        return _values(field, self.frame, points)


def require_printer(lattice: PrintedLattice) -> tuple[float, float]:
    """Layer height and pixel, mm.

    Raises
    ------
    LatticeError
        If the case states no layer height.
    """
    if lattice.layer_height is None or lattice.dense_field is None:
        raise LatticeError('layers need their height; state [print] layer_height = "0.03 mm"')
    return lattice.layer_height, lattice.pixel_size or lattice.layer_height


def slice_lattice(lattice: PrintedLattice) -> Layers:
    """Sample the layers of a lattice.

    Where no pixel is stated it is the layer height, or a half or a quarter of it where the layers
    do not hold the volume of the surface otherwise: walls that lie along rows of pixels gain or
    lose a whole row.

    Raises
    ------
    LatticeError
        If there is no printer, or the layers do not hold what the surface holds.
    """
    height, pixel = require_printer(lattice)
    meant = enclosed_volume(lattice.surface)
    for left in range(0 if lattice.pixel_size else HALVINGS, -1, -1):
        layers = _slice_at(lattice, height, pixel)
        volume = sum(_count(b) for b in layers.bits) * pixel**2 * height
        if abs(volume - meant) <= VOLUME_TOLERANCE * meant:
            return layers
        pixel *= 0.5 if left else 1.0
    raise LatticeError(
        f"layers of {height:g} mm with pixels of {pixel:g} mm hold {volume:.4g} mm^3, the "
        f"printed surface {meant:.4g} mm^3; expected the same within "
        f"{100 * VOLUME_TOLERANCE:g} %: state a smaller [print] layer_height or pixel_size"
    )


def _slice_at(lattice: PrintedLattice, height: float, pixel: float) -> Layers:
    """Layers of a lattice at one size of the pixels, mm, whatever volume they hold."""
    frame = np.array(FRAMES[lattice.build_direction], dtype=np.float64)
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
        bits=(),
    )
    field = dense_field(lattice, pixel)
    bits = _connected(_sampled(layers, field, count), layers.shape, lattice.bodies)
    return replace(layers, bits=tuple(bits))


def dense_field(lattice: PrintedLattice, pixel: float) -> Field:
    """The field of a lattice for sampling in steps of a pixel."""
    if lattice.dense_field is None:
        raise LatticeError("the lattice comes without a field")
    return lattice.dense_field(3.0 * pixel)


def _sampled(layers: Layers, field: Field, count: int) -> Iterator[BoolArray]:
    """Solid pixels of every layer, ``(nx, ny)``."""
    whole = np.ones(layers.shape, dtype=bool)
    for number in range(count):
        report_step("layers", number / count)
        yield (layers.values(number, field, whole) < 0.0).reshape(layers.shape)


def _values(field: Field, frame: FloatArray, points: FloatArray) -> FloatArray:
    values = np.zeros(points.shape[1])
    for low in range(0, len(values), _BATCH):
        part = slice(low, low + _BATCH)
        values[part] = checked_values(field, frame.T @ points[:, part])
    return values


def _connected(solids: Iterator[BoolArray], shape: tuple[int, int], bodies: int) -> list[bytes]:
    """Bits of the layers with the largest components alone, as many as there are bodies."""
    bits: list[bytes] = []
    first: list[int] = [0]
    sizes: list[IntArray] = []
    parent: list[int] = []
    before = np.zeros(shape, dtype=np.int64)
    for solid in solids:
        bits.append(_packed(solid))
        here, found = label(solid)
        start = first[-1]
        parent.extend(range(start, start + found))
        sizes.append(np.bincount(here.ravel(), minlength=found + 1)[1:])
        here = np.where(solid, here.astype(np.int64) + start, 0)
        both = (here > 0) & (before > 0)
        pairs = np.unique(np.stack([before[both], here[both]]), axis=1) - 1
        for a, b in pairs.T.tolist():
            parent[_root(parent, b)] = _root(parent, a)
        first.append(start + found)
        before = here
    if not parent:
        raise LatticeError("no pixel of any layer is solid; state a smaller [print] pixel_size")
    roots = np.array([_root(parent, k) for k in range(len(parent))])
    volume = np.bincount(roots, weights=np.concatenate(sizes), minlength=len(parent))
    kept = np.argsort(-volume, kind="stable")[:bodies]
    if np.count_nonzero(volume) <= bodies:
        return bits
    held = np.concatenate([[False], np.isin(roots, kept)])
    for number, packed in enumerate(bits):
        here, found = label(_unpacked(packed, shape))
        own = held[first[number] + np.arange(found + 1)]
        own[0] = False
        bits[number] = _packed(own[here])
    return bits


def _root(parent: list[int], k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


def _packed(solid: BoolArray) -> bytes:
    return zlib.compress(np.packbits(solid).tobytes(), 1)


def _unpacked(packed: bytes, shape: tuple[int, int]) -> BoolArray:
    bits = np.frombuffer(zlib.decompress(packed), dtype=np.uint8)
    return np.unpackbits(bits, count=shape[0] * shape[1]).reshape(shape).astype(bool)


def _count(packed: bytes) -> int:
    return int(np.unpackbits(np.frombuffer(zlib.decompress(packed), dtype=np.uint8)).sum())
