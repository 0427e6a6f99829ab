"""Short edges of a closed surface, collapsed, and vertices that nothing uses, dropped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, read_only
from gradedesign.geometry.triangles import _collapse_kernels as kernels
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Passes at most; in each, edges collapse that share no neighbours. Chosen, not measured.
PASSES = 16

_Faces = NDArray[np.int32] | NDArray[np.int64]


def without_short_edges(
    vertices: FloatArray, faces: _Faces, shortest: float, among: BoolArray | None = None
) -> NDArray[np.int32]:
    """Triangles with edges shorter than a length collapsed where the surface stays sound.

    Those that are given as int32 are changed on the way.

    Vertices do not move: of the two ends of an edge, the one stays from which the triangles round
    the other are less far away. An edge stays where a triangle would turn by more than 78 degrees
    or the surface would no longer be a manifold.

    Returns (k, 3) int32 array.

    - ``vertices (n, 3)``, mm
    - ``faces (m, 3)``: closed and manifold
    - ``shortest``, mm
    - ``among (n,)``: both ends of an edge that collapses are among these; all by default
    """
    # Of one type and permission: the kernels are compiled for each combination.
    vertices, faces = read_only(vertices), np.ascontiguousarray(faces, dtype=np.int32)
    for _ in range(PASSES):
        marked = np.zeros(len(vertices), dtype=np.bool_)
        if not kernels.mark_short(vertices, faces, shortest**2, marked):
            break
        if among is not None:
            marked &= among
        first, users = kernels.stars(faces, marked)
        locked = np.zeros(len(vertices), dtype=np.bool_)
        done, put_off = kernels.collapse_short(vertices, faces, shortest**2, first, users, locked)
        if done:
            faces = faces[faces[:, 0] >= 0]
        if not (done and put_off):
            break
    return faces


def used_only(vertices: FloatArray, faces: _Faces, chosen: BoolArray | None = None) -> SurfaceMesh:
    """A surface of chosen triangles and of the vertices that they use, in their order.

    Where all are used, the surface keeps ``vertices`` itself and locks it.
    """
    if chosen is None:
        chosen = np.ones(len(faces), dtype=bool)
    number, count = kernels.number_used(faces, chosen, len(vertices))
    packed = np.zeros((np.count_nonzero(chosen), 3), dtype=np.int64)
    kernels.renumber(faces, chosen, number, packed)
    if count < len(vertices):
        vertices = vertices[number >= 0]
    packed.flags.writeable = False  # new arrays of nobody else: the record need not copy them
    vertices.flags.writeable = False
    return SurfaceMesh(vertices=vertices, faces=packed)
