"""Rigid motions: their basis, and which of them supports leave free.

The six rigid motions, seen by the fixed components of a piece only, must be independent.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray

#: Squared sine below which directions count as dependent: supports 1e-5 of their spread apart.
DEPENDENT = 1e-10


def rigid_body_modes(points: FloatArray) -> FloatArray:
    """Three translations and three rotations about the centre of the points.

    Rotations are scaled to the size of the point set, so that all six are of like length. Returns
    ``(n, 3, 6)``: displacement of every point in every mode.

    ``points (3, n)``, mm.
    """
    x, y, z = points - points.mean(axis=1, keepdims=True)
    size = float(np.sqrt((x**2 + y**2 + z**2).mean())) or 1.0
    modes = np.zeros((points.shape[1], 3, 6))
    modes[:, range(3), range(3)] = 1.0
    modes[:, 1, 3], modes[:, 2, 3] = -z / size, y / size
    modes[:, 0, 4], modes[:, 2, 4] = z / size, -x / size
    modes[:, 0, 5], modes[:, 1, 5] = -y / size, x / size
    return modes


def free_modes(points: FloatArray, fixed: BoolArray) -> tuple[str, ...]:
    """Describe the rigid motions of one piece that its supports leave free.

    ``points (3, n)``, mm. ``fixed (3, n)``: components with a prescribed displacement.

    Returns
    -------
    tuple of str
        Empty where the piece is held.
    """
    if not fixed.any():
        return ("without any support",)
    fixed_points = points[:, fixed.any(axis=0)]
    centre = fixed_points.mean(axis=1)
    modes = rigid_body_modes(fixed_points)
    seen = modes[fixed[:, fixed.any(axis=0)].T]
    values, vectors = np.linalg.eigh(seen.T @ seen / len(seen))
    null = vectors[:, values < DEPENDENT * values[-1]]
    size = float(np.sqrt(((fixed_points - centre[:, None]) ** 2).sum(axis=0).mean())) or 1.0
    return _describe(null, size, centre)


def _describe(null: FloatArray, size: float, centre: FloatArray) -> tuple[str, ...]:
    """Name a space of motions: columns are a shift, then a turn times `size`, about `centre`."""
    if null.shape[1] == 0:
        return ()
    shift, turn = null[:3], null[3:]
    _, singular, right = np.linalg.svd(turn)
    rank = int((singular > 1e-6).sum())
    slides = _reduced(shift @ right[rank:].T)
    named = [f"free to translate along {_direction(t)}" for t in slides.T]
    turns = _reduced(np.concatenate([turn @ right[:rank].T, shift @ right[:rank].T]))
    for column in turns.T:
        w, t = column[:3] / size, column[3:]
        if slides.size:
            t = t - slides @ np.linalg.lstsq(slides, t, rcond=None)[0]
        point = centre + np.cross(w, t) / (w @ w)
        named.append(
            f"free to rotate about an axis through {triple_words(point)} mm along {_direction(w)}"
        )
    return tuple(named)


def _reduced(basis: FloatArray) -> FloatArray:
    """Equivalent basis with as many zeros as elimination gives, to recognise axes."""
    rows = basis.T.copy()
    count = len(rows)
    done = 0
    for column in range(rows.shape[1]):
        if done == count:
            break
        best = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[best, column]) < 1e-6 * np.abs(rows).max():
            continue
        rows[[done, best]] = rows[[best, done]]
        rows[done] /= rows[done, column]
        for row in range(count):
            if row != done:
                rows[row] -= rows[row, column] * rows[done]
        done += 1
    return rows[:done].T


def _direction(vector: FloatArray) -> str:
    """``x``, ``y``, ``z`` or a unit vector."""
    unit = vector / np.linalg.norm(vector)
    axis = int(np.argmax(np.abs(unit)))
    if abs(unit[axis]) > 1.0 - 1e-6:
        return "xyz"[axis]
    return triple_words(unit)


def triple_words(vector: FloatArray) -> str:
    """Three figures in brackets; rounding noise is shown as 0."""
    quiet = np.where(np.abs(vector) < 1e-6 * np.abs(vector).max(initial=0.0), 0.0, vector)
    return "({:.4g}, {:.4g}, {:.4g})".format(*quiet)
