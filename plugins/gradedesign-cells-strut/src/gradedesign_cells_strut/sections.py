"""Cross-sections of struts: the sides of a prism along each strut."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray

#: Sides of each section; none for a round one.
SIDES = {"round": 0, "square": 4, "triangle": 3}


def strut_frames(segments: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit direction of each strut and two unit vectors across it.

    The first vector across leans to the coordinate axis most nearly perpendicular to the strut;
    of equal ones, to the next after the axis along which the strut is longest. So a strut along a
    face diagonal gets the normal of its face, and permuting x, y, z permutes the frames.

    Parameters
    ----------
    segments : (m, 2, 3) array, cell units

    Returns
    -------
    along, first, second : (m, 3) arrays
        Right-handed; the direction is reversed where its first component that is not zero is
        negative.
    """
    along = segments[:, 1] - segments[:, 0]
    along = along / np.linalg.norm(along, axis=1)[:, None]
    along = np.where(np.abs(along) < 1e-9, 0.0, along)
    leading = np.take_along_axis(along, (along != 0).argmax(axis=1)[:, None], axis=1)
    along = along * np.sign(leading)
    size = np.round(np.abs(along), 9)
    row = np.arange(len(along))
    longest = size.argmax(axis=1)
    later = np.stack([(longest + i) % 3 for i in (1, 2, 3)], axis=1)
    reference = later[row, np.take_along_axis(size, later, axis=1).argmin(axis=1)]
    towards = np.eye(3)[reference]
    first = towards - (towards * along).sum(axis=1)[:, None] * along
    first = first / np.linalg.norm(first, axis=1)[:, None]
    return along, first, np.cross(along, first)


def section_normals(segments: FloatArray, section: str) -> FloatArray | None:
    """Unit normals of the sides of each strut, ``(m, sides, 3)``; None for round struts.

    One side faces the first vector of `strut_frames`.
    """
    sides = SIDES[section]
    if sides == 0:
        return None
    _, first, second = strut_frames(segments)
    angle = 2 * np.pi * np.arange(sides)[:, None] / sides
    return np.asarray(np.cos(angle) * first[:, None] + np.sin(angle) * second[:, None])
