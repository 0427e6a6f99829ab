"""Triangles of one surface that pass through each other or lie on each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, read_only
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.triangles import _contact_kernels as contact_kernels
from gradedesign.geometry.triangles import _crossing_kernels as kernels
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree

#: Leaves of the tree that are worth a thread. Chosen, not measured.
_AT_ONCE = 256
#: Triangles of a printed surface that reach less than this beyond each other only touch, mm. A
#: micrometre, below the detail of any printer.
TOUCHING = 1e-3


def crossing_triangles(vertices: FloatArray, faces: IntArray, margin: float) -> IntArray:
    """Pairs of triangles that pass through each other, ``(k, 2)``.

    Two triangles pass through each other where a side of one meets the inside of the other.
    Contact is no crossing: neither triangles that share an edge, nor those that reach less than
    the margin beyond each other, nor triangles that overlap in one plane.

    Returns (k, 2) int array: for every triangle that passes through later ones, itself and one of
    them; the same for any number of threads.

    ``vertices (n, 3)``, mm. ``faces (m, 3)``: neighbours share vertex numbers. ``margin``, mm:
    depth up to which triangles only touch.
    """
    crossed = np.full(len(faces), -1, dtype=np.int64)
    if len(faces) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    vertices, faces = read_only(vertices), read_only(np.asarray(faces, dtype=np.int32))
    tree = build_triangle_tree(vertices[faces])
    leaves = np.flatnonzero(tree.right < 0)
    in_ranges(
        *(kernels.find_crossed, range(0, len(leaves), _AT_ONCE), vertices, faces),
        *(tree.triangles, tree.box, tree.right, tree.first, tree.count, tree.order),
        *(leaves, margin, crossed),
    )
    rows = np.flatnonzero(crossed >= 0)
    return np.stack([rows, crossed[rows]], axis=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contacts:
    """Pairs of triangles that lie on each other, turned against each other."""

    first: IntArray  #: ``(k,)``.
    second: IntArray  #: ``(k,)``.
    area: FloatArray  #: ``(k,)``, mm^2. That both cover.
    distance: FloatArray  #: ``(k,)``, mm. Largest between them there.
    middle: FloatArray  #: ``(k, 3)``, mm. Of that area.


def find_contacts(vertices: FloatArray, faces: IntArray, reach: float) -> Contacts:
    """Find triangles without a common edge that lie on each other.

    Returns Contacts: sorted by the first triangle; the same for any number of threads.

    ``vertices (n, 3)``, mm. ``faces (m, 3)``. ``reach``, mm: largest distance; a common area
    narrower than this is none.
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
    in_ranges(
        contact_kernels.find_partners, range(len(faces)), *given, start, partners, second, values
    )
    total = int(partners.sum())
    second, values = np.zeros(total, dtype=np.int64), np.zeros((total, 5))
    if total:
        start = np.cumsum(partners) - partners
        in_ranges(
            contact_kernels.find_partners,
            range(len(faces)),
            *given,
            start,
            partners.copy(),
            second,
            values,
        )
    return Contacts(
        first=np.repeat(np.arange(len(faces)), partners),
        second=second,
        area=values[:, 0],
        distance=values[:, 1],
        middle=values[:, 2:],
    )
