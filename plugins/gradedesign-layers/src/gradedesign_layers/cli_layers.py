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

from gradedesign import PrintedLattice, ResourceError, in_threads, report_step
from gradedesign.fields import FloatArray, IntArray
from gradedesign_layers import _cli_kernels as kernels
from gradedesign_layers.contours import signed_area
from gradedesign_layers.layer_contours import LayerContours, layer_contours
from gradedesign_layers.layer_stack import Layers
from gradedesign_layers.layers import slice_lattice

_HEADER_END = b"$$HEADEREND"
#: Command of the binary form that begins a layer.
_LAYER = kernels.LAYER
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


def _export(path: Path, lattice: PrintedLattice, *, binary: bool) -> None:
    layers = slice_lattice(lattice, contoured=True)

    def contours(number: int) -> LayerContours:
        return layer_contours(layers, number)

    areas = [0.0]
    with path.open("wb") as file:
        file.write(_header(lattice, layers, binary=binary))
        _put_layer(file, layers.top(-1), binary=binary)
        count = len(layers.layers)
        for number, traced in enumerate(in_threads(contours, range(count))):
            report_step("contours of layers", number / count)
            places, first, enclosed = traced
            areas.append(float(enclosed.sum()))
            _put_layer(file, layers.top(number), binary=binary)
            _put_polygons(file, places, first, enclosed, binary=binary)
        if not binary:
            file.write(b"$$GEOMETRYEND\n")
    _read_back(path, layers, areas, binary=binary)


def _header(lattice: PrintedLattice, layers: Layers, *, binary: bool) -> bytes:
    corners = lattice.bounds @ layers.frame.T
    box = ",".join(f"{v:.6f}" for v in np.sort(corners, axis=0).ravel())
    name = "".join(c if c.isprintable() else " " for c in lattice.name)
    # "$$" begins a command, and one of them ends the header wherever it stands.
    name = re.sub(r"\$(?=\$)", "$ ", name)
    lines = [
        "$$HEADERSTART",
        "$$BINARY" if binary else "$$ASCII",
        "$$UNITS/00000001.000000",
        "$$VERSION/200",
        f"$$LABEL/1,{name}",
        f"$$DIMENSION/{box}",
        f"$$LAYERS/{len(layers.layers) + 1:06d}",
    ]
    head = "".join(f"{line}\n" for line in lines).encode("utf-8") + _HEADER_END
    return head if binary else head + b"\n$$GEOMETRYSTART\n"


def _put_layer(file: IO[bytes], top: float, *, binary: bool) -> None:
    file.write(struct.pack("<Hf", _LAYER, top) if binary else b"$$LAYER/%.6f\n" % top)


def _put_polygons(
    file: IO[bytes], places: FloatArray, first: IntArray, areas: FloatArray, *, binary: bool
) -> None:
    """Write the polygons of a layer, see `Tracer.polygons`."""
    if binary:
        bits = places.astype("<f4").view("<u4")
        out = np.zeros(22 * len(areas) + 8 * len(places), dtype=np.uint8)
        file.write(out[: kernels.pack_polygons(bits, first, areas, out)].tobytes())
        return
    for n, area in enumerate(areas):
        closed = np.append(places[first[n] : first[n + 1]], places[first[n] : first[n] + 1], axis=0)
        numbers = ",".join(f"{v:.6f}" for v in closed.ravel().tolist())
        line = f"$$POLYLINE/1,{int(area > 0.0)},{len(closed)},{numbers}\n"
        file.write(line.encode("ascii"))


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


def _read_back(path: Path, layers: Layers, areas: list[float], *, binary: bool) -> None:
    """Compare heights and areas of all layers, and whether every line closes."""
    tops, open_lines, area = (_scanned if binary else _listed)(path)
    count, volume = len(tops), area * layers.height
    heights = np.array([layers.top(n - 1) for n in range(len(areas))])
    apart = float(np.abs(tops - heights).max()) if count == len(areas) else 0.0
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


def _scanned(path: Path) -> tuple[FloatArray, int, float]:
    """Upper sides of the layers of a binary file, lines that do not close, area of all."""
    data = np.fromfile(path, dtype=np.uint8)
    head = data[: 1 << 16].tobytes().find(_HEADER_END)
    if head < 0:
        return np.zeros(0), 1, 0.0
    start = head + len(_HEADER_END)
    count, _, _ = kernels.scan_binary(data, start, np.zeros(0))
    tops = np.zeros(count)
    _, wrong, area = kernels.scan_binary(data, start, tops)
    return tops, int(wrong), float(area)


def _listed(path: Path) -> tuple[FloatArray, int, float]:
    """The same of any file, line by line."""
    tops, wrong, total = [], 0, 0.0
    for top, lines in read_cli(path):
        tops.append(top)
        for direction, points in lines:
            area = signed_area(points[:-1])
            wrong += int((points[0] != points[-1]).any() or (area > 0) != bool(direction))
            total += area
    return np.array(tops), wrong, total
