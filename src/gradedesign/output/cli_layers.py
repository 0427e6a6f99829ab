"""Layers as Common Layer Interface files, ASCII or binary.

Common Layer Interface (CLI) version 2.0, Brite-EuRam project BE-2578, 1994: coordinates in mm, a
layer by the height of its upper side, closed lines counter-clockwise (1) around solid and clockwise
(0) around holes. The first layer is empty and states where the second begins.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray
from gradedesign.errors import ResourceError
from gradedesign.output.contours import contours, signed_area
from gradedesign.output.layers import Layers, dense_field, slice_lattice
from gradedesign.output.printed_lattice import PrintedLattice
from gradedesign.workspace.progress import report_step

_HEADER_END = b"$$HEADEREND"
#: Commands of the binary form: a layer and a polyline, both of long numbers.
_LAYER, _POLYLINE = 127, 130
#: Values are this far from 0 at least, so that every point is between two pixels, of a pixel.
_CLEAR = 1e-6
#: Area read back may differ by text and float32 this share.
_SAME = 1e-3


def export_cli(path: Path, lattice: PrintedLattice) -> None:
    """Write layers as ASCII CLI, contoured from the field without a surface.

    Raises
    ------
    LatticeError
        If the case states no layer height, or the layers do not hold what the surface holds.
    ResourceError
        If what is read back differs.
    """
    _export(path, lattice, binary=False)


def export_cli_binary(path: Path, lattice: PrintedLattice) -> None:
    """Write layers as binary CLI; errors as of `export_cli`."""
    _export(path, lattice, binary=True)


def layer_polygons(layers: Layers, number: int, field: Field) -> list[FloatArray]:
    """Closed polygons ``(n, 2)`` of one layer in the axes of the machine, mm."""
    solid = layers.solid(number)
    near = _beside_change(solid)
    values = np.where(solid, -1.0, 1.0)
    found = np.abs(layers.values(number, field, near))
    values[near] *= np.maximum(found, _CLEAR * layers.pixel)
    values[~near] *= layers.pixel
    return [layers.lower[:2] + layers.pixel * polygon for polygon in contours(values)]


def _beside_change(solid: BoolArray) -> BoolArray:
    """Pixels with a neighbour that is not as they are."""
    near = np.zeros_like(solid)
    for axis in range(2):
        change = np.diff(solid, axis=axis)
        low = [slice(None)] * 2
        high = [slice(None)] * 2
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        near[tuple(low)] |= change
        near[tuple(high)] |= change
    return near


def _export(path: Path, lattice: PrintedLattice, *, binary: bool) -> None:
    layers = slice_lattice(lattice)
    field = dense_field(lattice, layers.pixel)
    areas = [0.0]
    with path.open("wb") as file:
        file.write(_header(lattice, layers, binary=binary))
        _put_layer(file, layers.top(-1), binary=binary)
        for number in range(len(layers.bits)):
            report_step("contours of layers", number / len(layers.bits))
            polygons = layer_polygons(layers, number, field)
            areas.append(sum(signed_area(polygon) for polygon in polygons))
            _put_layer(file, layers.top(number), binary=binary)
            for polygon in polygons:
                _put_polygon(file, polygon, binary=binary)
        if not binary:
            file.write(b"$$GEOMETRYEND\n")
    _read_back(path, layers, areas)


def _header(lattice: PrintedLattice, layers: Layers, *, binary: bool) -> bytes:
    corners = lattice.bounds @ layers.frame.T
    box = ",".join(f"{v:.6f}" for v in np.sort(corners, axis=0).ravel())
    name = "".join(c if c.isprintable() else " " for c in lattice.name)
    lines = [
        "$$HEADERSTART",
        "$$BINARY" if binary else "$$ASCII",
        "$$UNITS/00000001.000000",
        "$$VERSION/200",
        f"$$LABEL/1,{name}",
        f"$$DIMENSION/{box}",
        f"$$LAYERS/{len(layers.bits) + 1:06d}",
    ]
    head = "".join(f"{line}\n" for line in lines).encode("utf-8") + _HEADER_END
    return head if binary else head + b"\n$$GEOMETRYSTART\n"


def _put_layer(file: IO[bytes], top: float, *, binary: bool) -> None:
    file.write(struct.pack("<Hf", _LAYER, top) if binary else b"$$LAYER/%.6f\n" % top)


def _put_polygon(file: IO[bytes], polygon: FloatArray, *, binary: bool) -> None:
    closed = np.concatenate([polygon, polygon[:1]])
    direction = int(signed_area(polygon) > 0.0)
    if binary:
        file.write(struct.pack("<Hiii", _POLYLINE, 1, direction, len(closed)))
        file.write(closed.astype("<f4").tobytes())
    else:
        numbers = ",".join(f"{v:.6f}" for v in closed.ravel().tolist())
        file.write(f"$$POLYLINE/1,{direction},{len(closed)},{numbers}\n".encode("ascii"))


def read_cli(path: Path) -> Iterator[tuple[float, list[tuple[int, FloatArray]]]]:
    """Upper side of every layer and its polylines: direction and points ``(n, 2)``, mm."""
    with path.open("rb") as file:
        head = b""
        while not head.endswith(_HEADER_END):
            byte = file.read(1)
            if not byte:
                return
            head += byte
        yield from (_binary_layers(file) if b"$$BINARY" in head else _ascii_layers(file))


def _ascii_layers(file: IO[bytes]) -> Iterator[tuple[float, list[tuple[int, FloatArray]]]]:
    top: float | None = None
    lines: list[tuple[int, FloatArray]] = []
    for line in file:
        command, _, rest = line.decode("utf-8").strip().partition("/")
        if command in ("$$LAYER", "$$GEOMETRYEND"):
            if top is not None:
                yield top, lines
            top, lines = (float(rest), []) if rest else (None, [])
        elif command == "$$POLYLINE":
            _, direction, count, *numbers = re.split(",", rest)
            points = np.array(numbers, dtype=np.float64).reshape(int(count), 2)
            lines.append((int(direction), points))


def _binary_layers(file: IO[bytes]) -> Iterator[tuple[float, list[tuple[int, FloatArray]]]]:
    top: float | None = None
    lines: list[tuple[int, FloatArray]] = []
    while len(code := file.read(2)) == 2:
        if struct.unpack("<H", code)[0] == _LAYER:
            if top is not None:
                yield top, lines
            (top,), lines = struct.unpack("<f", file.read(4)), []
        else:
            _, direction, count = struct.unpack("<iii", file.read(12))
            points = np.frombuffer(file.read(8 * count), dtype="<f4").reshape(count, 2)
            lines.append((direction, points.astype(np.float64)))
    if top is not None:
        yield top, lines


def _read_back(path: Path, layers: Layers, areas: list[float]) -> None:
    """Compare heights and areas of all layers, and whether every line closes."""
    count, apart, volume, open_lines = 0, 0.0, 0.0, 0
    for top, lines in read_cli(path):
        if count < len(areas):
            apart = max(apart, abs(top - layers.top(count - 1)))
        count += 1
        for direction, points in lines:
            area = signed_area(points[:-1])
            open_lines += int((points[0] != points[-1]).any() or (area > 0) != bool(direction))
            volume += area * layers.height
    meant = sum(areas) * layers.height
    if (
        count != len(areas)
        or open_lines
        or apart > 1e-3 * layers.height
        or not abs(volume - meant) <= _SAME * meant
    ):
        raise ResourceError(
            f"{path} reads back as {count} layers with {open_lines} lines that do not close, "
            f"{volume:g} mm^3; expected {len(areas)}, none, {meant:g} mm^3 within 0.1 %; check the "
            f"disk and write it again"
        )
