"""Triangles of closed surfaces that lie on each other, with solid on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, read_only
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.triangles import _contact_kernels as kernels
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contacts:
    """Pairs of triangles that lie on each other, turned against each other.

    Attributes
    ----------
    first, second : (k,) int arrays
    area : (k,) array, mm^2
        That both cover.
    distance : (k,) array, mm
        Largest between them there.
    middle : (k, 3) array, mm
        Of that area.
    """

    first: IntArray
    second: IntArray
    area: FloatArray
    distance: FloatArray
    middle: FloatArray


def find_contacts(vertices: FloatArray, faces: IntArray, reach: float) -> Contacts:
    """Find triangles without a common edge that lie on each other.

    Parameters
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
    reach : float, mm
        Largest distance; a common area narrower than this is none.

    Returns
    -------
    Contacts
        Sorted by the first triangle; the same for any number of threads.
    """
    faces = read_only(np.ascontiguousarray(faces, dtype=np.int64))
    corners = np.ascontiguousarray(vertices[faces])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(across, axis=1)
    normals = across / np.where(double > 0.0, double, 1.0)[:, None]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    tree = build_triangle_tree(corners)
    given = (
        *(faces, corners, normals, 0.5 * double, longest),
        *(tree.box, tree.right, tree.first, tree.count, tree.order, reach),
    )
    start = np.full(len(faces), -1, dtype=np.int64)
    partners = np.zeros(len(faces), dtype=np.int64)
    second, values = np.zeros(0, dtype=np.int64), np.zeros((0, 5))
    in_ranges(kernels.find_partners, range(len(faces)), *given, start, partners, second, values)
    total = int(partners.sum())
    second, values = np.zeros(total, dtype=np.int64), np.zeros((total, 5))
    if total:
        start = np.cumsum(partners) - partners
        in_ranges(
            kernels.find_partners, range(len(faces)), *given, start, partners.copy(), second, values
        )
    return Contacts(
        first=np.repeat(np.arange(len(faces)), partners),
        second=second,
        area=values[:, 0],
        distance=values[:, 1],
        middle=values[:, 2:],
    )
