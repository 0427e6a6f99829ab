"""Weighing between size and right angles: cells within a tolerance of both, where possible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.maps._phase_kernels import centre_gradients, divergence, nearest_rotations

#: Allowed deviations of a cell: of its size, relative, and of its axes from the nearest
#: right-angled frame, rad. Met as far as least squares go, 95 % of volume then lie within 5 % and
#: 3 degrees.
_SIZE_TOLERANCE, _ANGLE_TOLERANCE = 0.02, np.radians(0.9)
#: Passes, and by how much each oversteps the way to the tolerances. Chosen, not measured.
PASSES, _OVERSTEP = 60, 1.8
#: Sizes that most of a map misses by more than this no continuous map follows: there, tolerances
#: only trade shear for size. Chosen, not measured.
NEAR, NEAR_SHARE = 0.10, 0.95
#: Elements up to which the passes are worth their time, 13 s of one processor for 90,000.
MOST_ELEMENTS = 250_000
#: With this many axes within 5 % of their size there is nothing to weigh. Chosen, not measured.
_KEPT_SHARE = 0.97


def within_tolerance(
    phases: FloatArray,
    rotation: FloatArray,
    size: FloatArray,
    steps: FloatArray,
    solve: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Phases whose cells keep to the tolerances better, or the same ones.

    Projects gradients on what the tolerances allow, then on gradients of functions (Poisson
    problems), in turn. Done only where `NEAR_SHARE` of the cell axes are within `NEAR` of their
    size to begin with, on grids of up to `MOST_ELEMENTS`, and not yet `_KEPT_SHARE`
    within 5 %; kept only if nothing folds and more of them are within 5 %.

    Parameters
    ----------
    phases : (3, nx, ny, nz) array
    rotation : (ex, ey, ez, 3, 3) array
        Nearest to the scaled gradients.
    size : (ex, ey, ez) array, mm
    steps : (3,) array, mm
    solve : callable
        Load of the Poisson problem to node values.

    Returns
    -------
    (3, nx, ny, nz) array

    References
    ----------
    Alternating projections, over-relaxed: Bauschke and Borwein, SIAM Review 38 (1996) 367.
    """
    if size.size > MOST_ELEMENTS:
        return phases
    matrix = centre_gradients(phases, steps) * size[..., None, None]
    if _share(matrix, NEAR) < NEAR_SHARE or _share(matrix, 0.05) >= _KEPT_SHARE:
        return phases
    frame, refined = rotation, phases
    for _ in range(PASSES):
        frame = nearest_rotations(matrix.reshape(-1, 3, 3), frame.reshape(-1, 3, 3))
        frame = frame.reshape(matrix.shape)
        target = matrix + _OVERSTEP * (_allowed(matrix, frame) - matrix)
        load = divergence(target / size[..., None, None], steps)
        refined = np.stack([solve(b) for b in load])
        before = matrix
        matrix = centre_gradients(refined, steps) * size[..., None, None]
        if np.abs(matrix - before).max() < 1e-6:
            break
    first = centre_gradients(phases, steps) * size[..., None, None]
    if np.linalg.det(matrix).min() <= 0 or _share(matrix, 0.05) < _share(first, 0.05):
        return phases
    return refined


def _allowed(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Nearest matrices, row by row, within the tolerances of a frame."""
    length = np.linalg.norm(matrix, axis=-1, keepdims=True)
    unit = matrix / length
    cosine = np.clip((unit * frame).sum(axis=-1, keepdims=True), -1.0, 1.0)
    across = unit - cosine * frame
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.minimum(np.arctan2(sine, cosine), _ANGLE_TOLERANCE)
    turned = np.cos(angle) * frame + np.sin(angle) * across / np.maximum(sine, 1e-15)
    return np.asarray(
        turned * np.clip(length, 1 / (1 + _SIZE_TOLERANCE), 1 / (1 - _SIZE_TOLERANCE))
    )


def _share(matrix: FloatArray, error: float) -> float:
    """Share of cell axes whose size is within an error of that wanted."""
    return float(np.mean(np.abs(1 / np.linalg.norm(matrix, axis=-1) - 1) <= error))
