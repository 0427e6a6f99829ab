"""Winding numbers of triangles, closed or not, about points, in logarithmic time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.triangles import _winding_kernels as kernels
from gradedesign.geometry.triangles._tree_kernels import CHUNK
from gradedesign.geometry.triangles.triangle_tree import TriangleTree, build_triangle_tree

#: Where turned triangles are looked for, in radii of the circle in a triangle, and how often.
#: Chosen, not measured.
_SHARE, _ROUNDS = 0.5, 3
#: A fall of the winding number through a triangle that settles at once that it is right; amid
#: others that are, it is 0.45.
_SURE = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindingTree:
    """A tree of triangles with the moments of its nodes."""

    tree: TriangleTree
    turn: IntArray  #: ``(m,)``. By sorted place: -1 where a triangle counts turned around, else 1.
    #: ``(k, 16)``. As :func:`gradedesign.geometry.triangles._winding_kernels.fill_moments` fills
    #: them: nodes farther away than twice their radius count by two terms, within 0.05 of the sum
    #: on a smooth surface (Barill, Dickson, Schmidt, Levin & Jacobson 2018, ACM Trans. Graph.
    #: 37(4), eqs. 14 to 18).
    moments: FloatArray


def winding_tree(tree: TriangleTree, turn: IntArray | None = None) -> WindingTree:
    """Moments of a tree of triangles, which count as they are or turned around."""
    if turn is None:
        turn = np.ones(len(tree.order), dtype=np.int64)
    moments = np.zeros((len(tree.box), 16))
    in_ranges(
        kernels.fill_moments,
        range(len(moments)),
        tree.triangles,
        turn,
        tree.box,
        tree.first,
        tree.count,
        moments,
    )
    return WindingTree(tree=tree, turn=turn, moments=moments)


def windings_about(winding: WindingTree, points: FloatArray) -> FloatArray:
    """Winding numbers about points ``(3, n)`` mm, ``(n,)``."""
    tree, result = winding.tree, np.zeros(points.shape[1])
    in_ranges(
        kernels.find_windings,
        range(0, len(result), CHUNK),
        tree.triangles,
        winding.turn,
        tree.right,
        tree.first,
        tree.count,
        winding.moments,
        np.ascontiguousarray(points, dtype=np.float64),
        result,
    )
    return result


def winding_numbers(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Winding numbers of triangles about points, within 0.05, ``(n,)``.

    Of a closed shell 1 inside, -1 inside a reversed one, 0 outside.

    ``corners (m, 3, 3)``, mm. ``points (3, n)``, mm.
    """
    return windings_about(winding_tree(build_triangle_tree(corners)), points)


def agreeing(winding: WindingTree) -> WindingTree:
    """Turn around the triangles that disagree with those about them.

    Left out, a triangle is a hole, through which the winding number of the others falls along the
    normal that it should have.
    """
    tree = winding.tree
    rise = np.zeros(len(tree.order))
    suspect = np.ones(len(rise), dtype=bool)
    for _ in range(_ROUNDS):
        in_ranges(
            kernels.find_rises,
            range(0, len(rise), CHUNK),
            tree.triangles,
            winding.turn,
            tree.right,
            tree.first,
            tree.count,
            winding.moments,
            _SHARE,
            suspect,
            rise,
        )
        against = suspect & (rise > 0.0)
        if not against.any():
            break
        winding = winding_tree(tree, np.where(against, -winding.turn, winding.turn))
        suspect = against | (rise > -_SURE)
    return winding
