"""Intersection of two closed surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradedesign.errors import MeshError
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.workspace.progress import report_step


def intersection(
    first: SurfaceMesh, second: SurfaceMesh, *, what: str, shortest: float = 0.0
) -> SurfaceMesh:
    """Closed surface of the volume that both enclose.

    Parameters
    ----------
    first, second : SurfaceMesh
        Closed, manifold, outward oriented.
    what : str
        Names the result in messages.
    shortest : float, mm
        Edges shorter than this are collapsed where the surface hardly moves.

    Raises
    ------
    MeshError
        If the Boolean kernel refuses a surface, or nothing is left.
    """
    # The kernel holds the interpreter's lock in each of its calls.
    report_step("reading the surfaces", blocking=True)
    solids = _manifold(first, what), _manifold(second, what)
    report_step("intersection", blocking=True)
    common = solids[0] ^ solids[1]
    empty = common.is_empty()  # the kernel computes when it is asked
    if shortest > 0 and not empty:
        report_step("collapsing short edges", blocking=True)
        common = common.as_original().simplify(shortest)
    mesh = common.to_mesh64()
    faces = np.asarray(mesh.tri_verts).astype(np.int64)
    if len(faces) == 0:
        raise MeshError(f"{what}: the two solids have no material in common")
    return SurfaceMesh(vertices=np.asarray(mesh.vert_properties)[:, :3], faces=faces)


def _manifold(surface: SurfaceMesh, what: str) -> Any:
    from manifold3d import Manifold, Mesh64

    # The kernel takes only writeable arrays.
    solid = Manifold(
        Mesh64(
            vert_properties=np.array(surface.vertices), tri_verts=surface.faces.astype(np.uint64)
        )
    )
    if solid.status().name != "NoError":
        raise MeshError(
            f"{what}: a surface of {len(surface.faces)} triangles cannot be cut, the Boolean "
            f"kernel reports {solid.status().name}; it must be closed and manifold"
        )
    return solid
