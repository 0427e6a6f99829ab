"""Layers as a stack of black and white PNG images, one pixel of the machine each, in a zip file.

Portable Network Graphics (PNG) Specification, third edition: greyscale of one bit, no filter.
"""

from __future__ import annotations

import json
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from gradedesign import PrintedLattice, ResourceError
from gradedesign.fields import BoolArray
from gradedesign_layers.layer_stack import Layers
from gradedesign_layers.layers import slice_lattice

#: What the images are: sizes, places, metadata.
_INDEX = "stack.json"

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DATE = (1980, 1, 1, 0, 0, 0)


def export_png_stack(path: Path, lattice: PrintedLattice) -> None:
    """Write a white pixel where the middle of a pixel, half-way up its layer, is solid.

    Images lie as seen from above, y upwards; ``stack.json`` says where they lie.

    Raises
    ------
    LatticeError
        If the case states no layer height, or the layers do not hold what the surface holds.
    ResourceError
        If what is read back differs.
    """
    layers = slice_lattice(lattice)
    width = max(5, len(str(len(layers.layers))))
    names = [f"layer_{number:0{width}d}.png" for number in range(len(layers.layers))]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as stack:
        stack.writestr(zipfile.ZipInfo(_INDEX, _DATE), json.dumps(_index(lattice, layers, names)))
        for number, name in enumerate(names):
            stack.writestr(zipfile.ZipInfo(name, _DATE), _png_bytes(layers.solid(number)))
    with zipfile.ZipFile(path) as stack:
        for number, name in enumerate(names):
            if not np.array_equal(_png_pixels(stack.read(name)), layers.solid(number)):
                raise ResourceError(
                    f"{name} in {path} reads back otherwise than it was written; check the disk "
                    f"and write it again"
                )


def _index(lattice: PrintedLattice, layers: Layers, names: list[str]) -> dict[str, object]:
    return {
        **lattice.metadata,
        "build_direction": lattice.build_direction,
        "pixel_size_mm": layers.pixel,
        "layer_height_mm": layers.height,
        "pixels": list(layers.shape),
        "lower_left_corner_mm": (layers.lower[:2] - 0.5 * layers.pixel).tolist(),
        "bottom_mm": float(layers.lower[2]),
        "machine_axes_in_part": layers.frame.tolist(),
        "layers": names,
    }


def _png_bytes(solid: BoolArray) -> bytes:
    """Image of pixels ``(nx, ny)``, white where solid, the last row of y on top."""
    nx, ny = solid.shape
    rows = np.packbits(solid.T[::-1], axis=1)
    filtered = np.concatenate([np.zeros((ny, 1), dtype=np.uint8), rows], axis=1)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", nx, ny, 1, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(filtered.tobytes(), 6)),
        (b"IEND", b""),
    )
    return _SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _png_pixels(image: bytes) -> BoolArray:
    """Pixels ``(nx, ny)`` of an image of `_png_bytes`."""
    nx, ny = struct.unpack(">II", image[16:24])
    (length,) = struct.unpack(">I", image[33:37])
    rows = np.frombuffer(zlib.decompress(image[41 : 41 + length]), dtype=np.uint8).reshape(ny, -1)
    return np.unpackbits(rows[:, 1:], axis=1, count=nx)[::-1].T.astype(bool)
