"""Reading voxels of a cell, and whether they repeat."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign import PluginError
from gradedesign.fields import FloatArray

log = logging.getLogger(__name__)

#: What a cell can be read from: a file, an array, or a stack of slices.
VoxelSource: TypeAlias = str | Path | ArrayLike | Sequence[ArrayLike]

#: Fewest voxels along an axis.
_FEWEST = 8


def read_voxels(voxels: VoxelSource) -> FloatArray:
    """Read voxels from a file, an array or a stack of slices.

    Parameters
    ----------
    voxels : path or array_like
        A ``.npy`` file, an ``.npz`` file with one array, an array ``(k, l, m)``, or k slices
        ``(l, m)``. Axes are x, y, z. Bool, whole or floating numbers; files may hold no objects.

    Returns
    -------
    (k, l, m) array

    Raises
    ------
    PluginError
        If the file cannot be read, or holds no three-dimensional array of finite numbers of at
        least `_FEWEST` along each axis that are not all equal.
    """
    name = f"voxel file {voxels}" if isinstance(voxels, str | Path) else "the voxel array"
    try:
        array = _load(Path(voxels)) if isinstance(voxels, str | Path) else np.asarray(voxels)
    except (OSError, ValueError, EOFError) as error:
        raise PluginError(
            f"{name} cannot be read as .npy or .npz with numbers, or its slices differ in shape: "
            f"{error}"
        ) from error
    if array.dtype.kind not in "biuf":
        raise PluginError(f"{name} holds {array.dtype}, expected bool, whole or floating numbers")
    if array.ndim != 3 or min(array.shape) < _FEWEST:
        raise PluginError(
            f"{name} has shape {array.shape}, expected (x, y, z) with at least {_FEWEST} along each"
        )
    values = np.array(array, dtype=np.float64)
    bad = int(np.count_nonzero(~np.isfinite(values)))
    if bad:
        raise PluginError(f"{name} holds {bad} values that are not finite")
    if values.min() == values.max():
        raise PluginError(f"{name} holds nothing but {values.min():g}: no surface to find")
    return values


def require_periodic(solid: NDArray[np.bool_], tolerance: float) -> None:
    """Refuse voxels whose opposite faces do not continue each other.

    The last slice and the first are neighbours once the cell repeats. They may differ by the
    tolerance, or by half more than the most different neighbours inside the cell do.

    Parameters
    ----------
    solid : (k, l, m) bool array
    tolerance : float
        Share of a face.

    Raises
    ------
    PluginError
        Naming the faces, how much of them differs, and what to do.
    """
    for axis, name in enumerate("xyz"):
        slices = np.moveaxis(solid, axis, 0)
        step = (slices[1:] != slices[:-1]).mean(axis=(1, 2))
        across = float((slices[0] != slices[-1]).mean())
        inside = float(step.max())
        log.info(
            "faces across %s differ in %.2f %%, slices %.2f %%", name, 1e2 * across, 1e2 * inside
        )
        if across > max(tolerance, 1.5 * inside):
            raise PluginError(
                f"the voxels do not repeat along {name}: the first and the last slice, which are "
                f"neighbours when cells repeat, differ in {across:.1%} of the face, neighbouring "
                f"slices inside in {inside:.1%} at most; cut the cell to exactly one period, or "
                f"mirror it, or allow it with tolerance = {across:.2f}"
            )


def drop_repeated_ends(values: FloatArray) -> FloatArray:
    """Remove the last plane along each axis, which repeats the first.

    Raises
    ------
    PluginError
        If it does not.
    """
    spread = float(np.ptp(values))
    for axis, name in enumerate("xyz"):
        slices = np.moveaxis(values, axis, 0)
        error = float(np.abs(slices[0] - slices[-1]).max())
        if error > 1e-6 * spread:
            raise PluginError(
                f"the voxels were said to repeat their first plane at the end (endpoint=True), but "
                f"along {name} the planes differ by up to {error:.3g} of a range of {spread:.3g}; "
                f"use endpoint=False for voxels from 0 to n - 1"
            )
    return values[:-1, :-1, :-1]


def _load(path: Path) -> NDArray[np.generic]:
    """Array of a file of numbers."""
    loaded = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return loaded
    with loaded:
        if len(loaded.files) != 1:
            raise ValueError(f"it holds the arrays {loaded.files}, expected one")
        return np.asarray(loaded[loaded.files[0]])
