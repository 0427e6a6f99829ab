"""The file of a solid: triangles with the face of each, names and surfaces of the faces.

An archive of arrays as numpy writes them (npz) without pickled objects: ``corners`` (m, 3, 3) in
mm, ``label`` (m,), and ``about``, a text in UTF-8 with a JSON object. The same solid gives the same
bytes, so that the hash of a case stays.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import ExactSurface, FileFaces, PartError, RawTriangles, raw_triangles

SUFFIX = ".solid"
#: Of the content of the file.
_VERSION = 1
#: Bytes that its arrays may take: 20 million triangles, more than can be repaired and meshed.
_MOST_BYTES = 20_000_000 * 80
_ARRAYS = ("corners", "label", "about")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solid:
    """A triangulated solid.

    Attributes
    ----------
    corners : (m, 3, 3) array, mm
    label : (m,) int array
        Face of each triangle, counted from 1.
    names : dict of int to str
        By face.
    surfaces : dict of int to dict
        Kind of each face, and of a cylinder axis, point and diameter, mm.
    chord_tolerance : float, mm
    """

    corners: NDArray[np.float64]
    label: NDArray[np.int64]
    names: dict[int, str]
    surfaces: dict[int, dict[str, Any]]
    chord_tolerance: float


def write_solid(path: Path, solid: Solid) -> None:
    """Write a file whole, in place of one that is there.

    Raises PartError if it cannot be written.
    """
    about = {
        "version": _VERSION,
        "names": solid.names,
        "surfaces": solid.surfaces,
        "chord_tolerance": solid.chord_tolerance,
    }
    text = json.dumps(about, sort_keys=True).encode()
    data = io.BytesIO()
    np.savez_compressed(
        data,
        corners=solid.corners,
        label=solid.label,
        about=np.frombuffer(text, dtype=np.uint8),
        allow_pickle=False,
    )
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.unfinished")
    try:
        unfinished.write_bytes(data.getvalue())
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise PartError(f"{path}: cannot be written ({error.strerror})") from error


def read_solid(path: Path) -> RawTriangles:
    """Read a file that `write_solid` has written.

    Raises
    ------
    PartError
        If it is missing, damaged, larger than a part can be, or of another version.
    """
    try:
        _require_size(path)
        with np.load(path, allow_pickle=False) as arrays:
            corners, label, text = (arrays[name] for name in _ARRAYS)
        about = json.loads(text.tobytes().decode())
        version = about["version"]
        raw = None if version != _VERSION else _triangles(path.name, corners, label, about)
    except OSError as error:
        raise PartError(f"{path.name}: cannot be read ({error})") from error
    except (ValueError, KeyError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise PartError(
            f"{path.name}: damaged, or no file of gradedesign_cad.write_part ({error}); write it "
            f"again"
        ) from error
    if raw is None:
        raise PartError(f"{path.name}: of version {version}, expected {_VERSION}; write it again")
    return raw


def _triangles(
    source: str, corners: NDArray[Any], label: NDArray[Any], about: dict[str, Any]
) -> RawTriangles:
    """Triangles and faces as the core takes them."""
    faces = FileFaces(
        label=label,
        names={int(number): name for number, name in about["names"].items()},
        surfaces={
            int(number): ExactSurface(**surface) for number, surface in about["surfaces"].items()
        },
    )
    return raw_triangles(
        corners,
        source=source,
        unit="mm",
        faces=faces,
        chord_tolerance=float(about["chord_tolerance"]),
    )


def _require_size(path: Path) -> None:
    """Refuse an archive that is unpacked to more than a part can be."""
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
    if size > _MOST_BYTES:
        raise PartError(f"{path.name}: {size} bytes once unpacked; at most {_MOST_BYTES} are read")
