"""Readers of voxel files: NPY and NPZ arrays, image stacks and NRRD volumes."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import (
    CaseError,
    PartError,
    slices_with,
)
from gradedesign_volumes.image_stack import read_images
from gradedesign_volumes.npy_file import read_npy, read_npy_stream
from gradedesign_volumes.nrrd_file import read_nrrd_file
from gradedesign_volumes.voxel_volume import BYTES_PER_VOXEL, VoxelVolume

#: Entry of an archive that holds the edges of a voxel.
_SPACING = "spacing"
_MOST_ENTRIES = 2


def read_npy_volume(path: Path, memory_limit_bytes: int) -> VoxelVolume:
    """Read a ``.npy`` array (nx, ny, nz).

    Raises
    ------
    PartError
        If the file is damaged or holds something else.
    ResourceError
        If it takes more memory.
    """
    try:
        values = read_npy(
            path, memory_limit_bytes=memory_limit_bytes, bytes_per_value=BYTES_PER_VOXEL
        )
    except CaseError as error:
        raise PartError(str(error)) from error
    return VoxelVolume(values=_volume(values, path.name))


def read_npz_volume(path: Path, memory_limit_bytes: int) -> VoxelVolume:
    """Read a ``.npz`` archive of one array (nx, ny, nz), and ``spacing`` of three numbers or none.

    Raises
    ------
    PartError, ResourceError
        As of `read_npy_volume`.
    """
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            if len(entries) > _MOST_ENTRIES:
                raise PartError(
                    f"{path.name} holds {len(entries)} arrays; expected one volume, and "
                    f"{_SPACING} or none"
                )
            for entry in entries:
                with archive.open(entry) as stream:
                    arrays[entry.filename.removesuffix(".npy")] = read_npy_stream(
                        stream,
                        f"{path.name}: {entry.filename}",
                        entry.file_size,
                        memory_limit_bytes=memory_limit_bytes,
                        bytes_per_value=BYTES_PER_VOXEL,
                    )
    except (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError) as error:
        # RuntimeError is an encrypted entry.
        raise PartError(f"{path.name} cannot be read as an .npz archive: {error}") from error
    except CaseError as error:
        raise PartError(str(error)) from error
    spacing = arrays.pop(_SPACING, None)
    if len(arrays) != 1:
        names = ", ".join(sorted(arrays)) or "none"
        raise PartError(
            f"{path.name} holds the arrays {names}; expected one volume, and {_SPACING} or none"
        )
    return VoxelVolume(
        values=_volume(next(iter(arrays.values())), path.name),
        spacing=None if spacing is None else _three(spacing, path.name),
    )


def read_image_volume(path: Path, memory_limit_bytes: int) -> VoxelVolume:
    """Read the stack of slices along z to which an image belongs, by the number in its name.

    Columns of an image go along x; its last row has the lowest y, as on paper.

    Raises
    ------
    PartError, ResourceError
        As of `read_npy_volume`; also for a single image.
    """
    files = slices_with(path)
    if len(files) < 2:
        raise PartError(
            f"{path.name}: found one image; expected a stack of them, whose names differ in their "
            f"numbers"
        )
    try:
        values = read_images(
            files, memory_limit_bytes=memory_limit_bytes, bytes_per_value=BYTES_PER_VOXEL
        )
    except CaseError as error:
        raise PartError(str(error)) from error
    return VoxelVolume(values=_volume(values, path.name))


def read_nrrd_volume(path: Path, memory_limit_bytes: int) -> VoxelVolume:
    """Read an ``.nrrd`` volume; errors as of `read_npy_volume`."""
    volume = read_nrrd_file(
        path, memory_limit_bytes=memory_limit_bytes, bytes_per_value=BYTES_PER_VOXEL
    )
    _volume(volume.values, path.name)
    return volume


def _volume(values: NDArray[np.generic], name: str) -> NDArray[np.generic]:
    if values.ndim != 3 or 0 in values.shape:
        raise PartError(f"{name} holds {values.shape}; expected one array (nx, ny, nz)")
    return values


def _three(values: NDArray[Any], name: str) -> tuple[float, float, float]:
    if values.shape != (3,) or values.dtype.kind not in "fiu":
        raise PartError(f"{name}: {_SPACING} is {values.shape}; expected three numbers")
    x, y, z = (float(v) for v in values)
    return x, y, z
