"""Bodies that a case names: some of the part's, or closed ones from files of their own."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import IntArray
from gradedesign.case.place_schema import BodySpec
from gradedesign.case.schema import CaseIdentity
from gradedesign.errors import CaseError
from gradedesign.mesh.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.mesh.winding import winding_numbers


def stated_bodies(case: CaseIdentity) -> dict[str, BodySpec]:
    """Bodies of passive solids and zones by their keys in the case, such as ``keep[0].body``."""
    places = [(f"keep[{k}].body", keep.body) for k, keep in enumerate(case.keep)]
    zones = getattr(case, "zone", ())
    places += [(f"zone[{k}].body", zone.body) for k, zone in enumerate(zones)]
    return {key: body for key, body in places if body is not None}


def bodies_with(surface: SurfaceMesh, triangles: IntArray) -> SurfaceMesh:
    """Surface of the bodies, with their voids, to which triangles of a part's surface belong.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed; its shells share no vertices.
    triangles : (k,) int array

    Raises
    ------
    CaseError
        If these are all bodies of the part.
    """
    ends = surface.faces[:, [0, 1, 1, 2]].reshape(-1, 2).T
    graph = coo_array((np.ones(ends.shape[1]), tuple(ends)), shape=(len(surface.vertices),) * 2)
    count, of_vertex = connected_components(graph, directed=False)
    label = of_vertex[surface.faces[:, 0]]
    shells = [
        SurfaceMesh(vertices=surface.vertices, faces=surface.faces[label == n])
        for n in range(count)
    ]
    volumes = np.array([enclosed_volume(shell) for shell in shells])
    owner = np.arange(count)
    for void in np.flatnonzero(volumes < 0):
        place = surface.vertices[shells[void].faces[0, :1]]
        around = [
            n
            for n in np.flatnonzero(volumes > 0)
            if winding_numbers(corner_points(shells[n]), place)[0] > 0.5
        ]
        owner[void] = min(around, key=volumes.__getitem__)
    selected = np.isin(owner, owner[np.unique(label[triangles])])
    if selected.all():
        raise CaseError(
            f"its faces belong to all {int((volumes > 0).sum())} bodies of the part, which would "
            f"stay solid as a whole; expected a region on one of several bodies, or a file"
        )
    return SurfaceMesh(vertices=surface.vertices, faces=surface.faces[selected[label]])
