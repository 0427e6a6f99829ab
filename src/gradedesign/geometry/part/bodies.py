"""Bodies that a case names: some of the part's, or closed ones from files of their own."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import IntArray
from gradedesign.errors import CaseError
from gradedesign.geometry.part._edges import linked_sets
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.winding import winding_numbers

#: Corners of a void by which the solid around it is found: one may lie on another's surface.
#: Chosen, not measured.
_PLACES = 16


def body_of_triangles(surface: SurfaceMesh) -> IntArray:
    """Number of the body of every triangle ``(m,)``, counted from 0; voids go with the solid.

    ``surface``: closed; its shells share no vertices.
    """
    ends = surface.faces[:, [0, 1, 1, 2]].reshape(-1, 2).T
    of_vertex = linked_sets(ends, len(surface.vertices))
    label = of_vertex[surface.faces[:, 0]]
    corners = corner_points(surface)
    a, b, c = np.moveaxis(corners - surface.vertices.mean(axis=0), 1, 0)
    volumes = np.bincount(label, np.einsum("ij,ij->i", a, np.cross(b, c)))
    solids = np.flatnonzero(volumes > 0.0)
    owner = np.arange(len(volumes))
    if len(solids) == 1:
        owner[:] = solids[0]
    else:
        for void in np.flatnonzero(volumes < 0.0):
            places = corners[label == void][:_PLACES, 0].T
            share = [winding_numbers(corners[label == n], places).mean() for n in solids]
            around = solids[np.array(share) > 0.5]
            owner[void] = min(around, key=volumes.__getitem__) if len(around) else void
    return np.unique(owner[label], return_inverse=True)[1].astype(np.int64)


def bodies_with(surface: SurfaceMesh, triangles: IntArray) -> SurfaceMesh:
    """Surface of the bodies, with their voids, to which triangles of a part's surface belong.

    Raises CaseError if these are all bodies of the part.

    ``surface``: closed; its shells share no vertices. ``triangles (k,)``.
    """
    body = body_of_triangles(surface)
    selected = np.isin(body, body[triangles])
    if selected.all():
        raise CaseError(
            f"its faces belong to all {int(body.max()) + 1} bodies of the part, which would "
            f"stay solid as a whole; expected a region on one of several bodies, or a file"
        )
    return SurfaceMesh(vertices=surface.vertices, faces=surface.faces[selected])
