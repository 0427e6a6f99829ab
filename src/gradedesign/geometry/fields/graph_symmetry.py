"""The point symmetry of a set of struts of period 1."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.fields.graph import direction_keys, periodic_keys

_MIRROR_X = np.diag([-1.0, 1.0, 1.0])
_MIRROR_Y = np.diag([1.0, -1.0, 1.0])
_SWAP_XY = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_CYCLE = np.roll(np.eye(3), 1, axis=0)


def segment_symmetry(
    segments: ArrayLike, *, thickness: ArrayLike = 1.0, normals: ArrayLike | None = None
) -> Literal["cubic", "tetragonal", "orthotropic", "none"]:
    """Symmetry of the stiffness of struts, for `CellFamily`, from their geometry.

    An operation counts when it, or its product with the inversion, takes the struts to a shifted
    copy of themselves: a stiffness sees neither shifts nor the inversion.

    Parameters
    ----------
    segments, thickness, normals
        As in `periodic_distance_to_segments`.

    Examples
    --------
    >>> axes = [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 1]]]
    >>> segment_symmetry(axes)
    'cubic'
    >>> segment_symmetry(axes, thickness=[1, 1, 2])
    'tetragonal'
    """
    ends = np.array(segments, dtype=np.float64)
    sides = np.zeros((len(ends), 0, 3)) if normals is None else np.array(normals, dtype=np.float64)
    relative = np.array(np.broadcast_to(np.asarray(thickness, dtype=np.float64), (len(ends),)))

    def holds(operation: FloatArray) -> bool:
        return any(_maps(ends, relative, sides, sign * operation) for sign in (1.0, -1.0))

    if not (holds(_MIRROR_X) and holds(_MIRROR_Y)):
        return "none"
    if holds(_CYCLE):
        return "cubic"
    return "tetragonal" if holds(_SWAP_XY) else "orthotropic"


def _maps(
    ends: FloatArray, thickness: FloatArray, sides: FloatArray, operation: FloatArray
) -> bool:
    """Whether an operation, followed by some shift, maps the struts onto themselves."""
    middle, kind = ends.mean(axis=1), _kinds(ends, thickness, sides)
    moved, moved_kind = (
        middle @ operation.T,
        _kinds(ends @ operation.T, thickness, sides @ operation.T),
    )
    target = _sorted_rows(np.concatenate([periodic_keys(middle), kind], axis=1))
    # The first moved strut must land on one like it; that fixes the shift.
    for image in np.flatnonzero((kind == moved_kind[0]).all(axis=1)):
        shifted = moved + (middle[image] - moved[0])
        moved_rows = _sorted_rows(np.concatenate([periodic_keys(shifted), moved_kind], axis=1))
        if np.array_equal(moved_rows, target):
            return True
    return False


def _kinds(ends: FloatArray, thickness: FloatArray, sides: FloatArray) -> IntArray:
    """Integers that are equal for struts that differ in their position only, ``(m, ...)``."""
    steps = np.asarray(np.rint(sides * 1e6), dtype=np.int64)
    for column in (2, 1, 0):
        order = np.argsort(steps[:, :, column], axis=1, kind="stable")
        steps = np.take_along_axis(steps, order[:, :, None], axis=1)
    return np.concatenate(
        [
            direction_keys(ends[:, 1] - ends[:, 0]),
            np.rint(thickness * 1e6).astype(np.int64)[:, None],
            steps.reshape(len(ends), -1),
        ],
        axis=1,
    )


def _sorted_rows(keys: IntArray) -> IntArray:
    """Rows in lexicographic order."""
    return keys[np.lexsort(keys.T[::-1])]
