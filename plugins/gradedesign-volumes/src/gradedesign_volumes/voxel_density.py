"""Density from a voxel array: floats are densities, 8 and 16 bit whole numbers grey values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from gradedesign import CaseError, DensityError
from gradedesign.fields import Field, FloatArray
from gradedesign_volumes.npy_file import read_npy

#: Memory for a voxel beside what is read: its density, a copy in another order, whether it is one.
BYTES_PER_VOXEL = 18
#: The box of the voxels may miss the part's by this share of a voxel. Chosen, not measured.
_SLACK = 0.5


def read_voxel_array(path: Path, *, memory_limit_bytes: int) -> NDArray[np.generic]:
    """Read a ``.npy`` array of three dimensions; nothing in it is run.

    Parameters
    ----------
    memory_limit_bytes : int
        What reading it and making densities of it may take.

    Raises
    ------
    CaseError
        If the file cannot be read, is damaged, or holds something else.
    ResourceError
        If it takes more memory.
    """
    values = read_npy(path, memory_limit_bytes=memory_limit_bytes, bytes_per_value=BYTES_PER_VOXEL)
    if values.ndim != 3 or 0 in values.shape:
        raise CaseError(f"{path.name} holds {values.shape}; expected one array (nx, ny, nz)")
    return values


def densities(values: NDArray[np.generic], grey: tuple[float, float] | None) -> FloatArray:
    """Relative densities of voxels.

    Parameters
    ----------
    values : (nx, ny, nz) array
        Floats are densities. Of ``uint8`` and ``uint16`` 0 stands for the first density of
        ``grey``, the largest number of the type for the second, linear between.
    grey : (float, float), optional
        Densities of black and white.

    Returns
    -------
    (nx, ny, nz) array

    Raises
    ------
    CaseError
        If grey values come without ``grey``, or the type is another.
    DensityError
        If a value is not finite.
    """
    if values.dtype in (np.dtype(np.uint8), np.dtype(np.uint16)):
        if grey is None:
            raise CaseError(
                f"grey values of {8 * values.dtype.itemsize} bit need the densities of black and "
                f"white: add density = [low, high]"
            )
        low, high = grey
        full = float(np.iinfo(np.dtype(values.dtype).name).max)
        result = values.astype(np.float64)
        result *= (high - low) / full  # in place: a map may take most of the memory there is
        result += low
        return result
    if values.dtype.kind != "f":
        raise CaseError(
            f"voxels of type {values.dtype} are neither densities nor grey values; expected "
            f"floats, uint8 or uint16"
        )
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused next
        result = values.astype(np.float64)
    if not np.isfinite(result).all():
        raise DensityError(
            f"{np.count_nonzero(~np.isfinite(result))} of {result.size} voxels are not finite"
        )
    return result


def voxel_density(values: FloatArray, lower: ArrayLike, size: ArrayLike) -> Field:
    """Trilinear density between the centres of voxels, constant beyond the outer centres.

    Parameters
    ----------
    values : (nx, ny, nz) array
        Relative densities.
    lower : (3,) array_like, mm
        Lower corner of the first voxel.
    size : (3,) array_like, mm
        Edges of a voxel.
    """
    values = np.ascontiguousarray(values, dtype=np.float64)
    start = np.asarray(lower, dtype=np.float64)
    edges = np.broadcast_to(np.asarray(size, dtype=np.float64), (3,))

    def density(points: FloatArray) -> FloatArray:
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        index = (flat - start[:, None]) / edges[:, None] - 0.5
        interpolated = map_coordinates(values, index, order=1, mode="nearest")
        return np.asarray(interpolated).reshape(points.shape[1:])

    return density


def place_voxels(
    shape: tuple[int, ...],
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    voxel_size: float | None = None,
    origin: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Placement of the voxels: lower corner and edges ``(3,)``, mm.

    Without ``voxel_size`` they are stretched from the origin to the upper end of the part's box.

    Parameters
    ----------
    shape : (int, int, int)
    lower, upper : (3,) array_like, mm
        The part's box.
    voxel_size : float, optional, mm
    origin : (3,) array_like, optional, mm
        ``lower`` without it.

    Raises
    ------
    CaseError
        If the voxels do not cover the part's box.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    start = lower if origin is None else np.asarray(origin, dtype=np.float64)
    count = np.array(shape, dtype=np.float64)
    edges = (upper - start) / count if voxel_size is None else np.full(3, voxel_size)
    short = (start > lower + _SLACK * edges) | (start + count * edges < upper - _SLACK * edges)
    if short.any() or not (edges > 0).all():
        needed = np.ceil((upper - start) / edges - _SLACK) if (edges > 0).all() else None
        wanted = "" if needed is None else f", at least {_times(needed)} from that origin"
        raise CaseError(
            f"{_times(count)} voxels of {_times(edges, ' mm')} from {_point(start)} mm do not "
            f"cover the part, which reaches from {_point(lower)} to {_point(upper)} mm; expected "
            f"an array that does{wanted}; or leave out voxel_size to stretch it over the part"
        )
    return start, edges


def _times(values: FloatArray, unit: str = "") -> str:
    return " x ".join(f"{v:.4g}" for v in values) + unit


def _point(values: FloatArray) -> str:
    return f"({', '.join(f'{v:.4g}' for v in values)})"
