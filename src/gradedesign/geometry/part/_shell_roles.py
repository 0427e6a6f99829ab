"""Role of each closed shell in the part: solid, void, hole, fragment, or nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import linked_sets
from gradedesign.geometry.part._nesting import Nesting

#: A disconnected component below this share of the largest one's volume is a fragment. Chosen, not
#: measured.
FRAGMENT_SHARE = 1e-3
#: Fragments above this share of the other volume together are no fragments. Chosen, not measured.
_FRAGMENTS_SHARE = 1e-2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShellRoles:
    """The part each shell plays, ``(s,)`` arrays."""

    sign: IntArray  #: +1 for shells that add material, -1 for those that take it.
    inverted: BoolArray  #: Turned around, since the file has them inside out.
    #: Dropped as too small; dropped inside a solid; a hole that reaches out of the solid.
    fragment: BoolArray
    ignored: BoolArray  #: As `fragment`.
    cut: BoolArray  #: As `fragment`.
    kept: BoolArray  #: Bounds material.


def shell_roles(
    nesting: Nesting, volumes: FloatArray, sign: IntArray, inverted: BoolArray, touching: BoolArray
) -> ShellRoles:
    """Role of each shell, from the relative positions of the shells.

    ``volumes (s,)``, mm^3. ``sign``, ``inverted``, each ``(s,)``: as `outward_signs` returns them.
    ``touching (s, s)``: which shells have faces in common.
    """
    fragment = _fragments(_clusters(nesting.inside | nesting.overlap | touching), volumes)
    outside = _outside(nesting, sign)
    cut = ~fragment & (sign < 0) & (outside <= 0) & nesting.overlap[:, sign > 0].any(axis=1)
    bounding = ((outside > 0) != (outside + sign > 0)) | cut
    return ShellRoles(
        sign=sign,
        inverted=inverted,
        fragment=fragment,
        ignored=~bounding & ~fragment,
        cut=cut,
        kept=bounding & ~fragment,
    )


def _outside(nesting: Nesting, sign: IntArray) -> IntArray:
    """Solids less voids around each shell; a reversed shell that lies in no solid takes none."""
    outside = np.zeros(len(sign), dtype=np.int64)
    takes = sign.copy()
    for k in np.argsort(nesting.inside.sum(axis=1), kind="stable").tolist():
        outside[k] = takes[nesting.inside[k]].sum()
        if sign[k] < 0 and outside[k] <= 0:
            takes[k] = 0
    return outside


def _clusters(related: BoolArray) -> IntArray:
    """Number the sets of shells that are related, ``(s,)``."""
    return linked_sets(np.nonzero(related), len(related))


def _fragments(cluster: IntArray, volumes: FloatArray) -> BoolArray:
    """Mask of disconnected components too small to belong to the part, unless their sum is not."""
    size = np.bincount(cluster, np.abs(volumes))
    small = size < FRAGMENT_SHARE * size.max()
    if size[small].sum() > _FRAGMENTS_SHARE * size[~small].sum():
        small[:] = False
    return np.asarray(small[cluster])


def outward_signs(nesting: Nesting, volumes: FloatArray, source: str) -> tuple[IntArray, BoolArray]:
    """+1 for shells that add material, -1 for those that take it, and which had to be flipped.

    Everything that lies in or across an inverted largest shell is flipped with it: the file is
    inside out.

    Raises PartError if a shell crosses a larger one that runs the other way round and is the
    inverted one.
    """
    cluster = _clusters(nesting.inside | nesting.overlap)
    order = np.lexsort((-volumes, -np.abs(volumes)))
    _, first = np.unique(cluster[order], return_index=True)
    largest = order[first][cluster]
    inverted = volumes[largest] < 0
    mixed = nesting.overlap & (np.sign(volumes)[:, None] != np.sign(volumes)[None, :])
    if (mixed.any(axis=1) & inverted).any():
        k = int(np.flatnonzero(mixed.any(axis=1) & inverted)[0])
        raise PartError(
            f"{source}: a reversed shell of {abs(volumes[largest[k]]):.4g} mm^3 crosses smaller "
            "outward ones, so it is unclear what is solid; turn its normals or cut it out in CAD"
        )
    return np.where((volumes > 0) ^ inverted, 1, -1), inverted
