"""The only place that imports pymeshlab, in a process of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError, serve_repairer

#: Edges of the largest hole that is filled where the case does not say.
_HOLE_EDGES = 100
#: Deviation of remeshing over the edge length where the case does not say.
_DEVIATION = 0.01
#: Angle between facets, degrees, from which an edge is kept.
_CREASE = 30.0


def mend(
    vertices: NDArray[Any], faces: NDArray[Any], options: Mapping[str, Any]
) -> tuple[NDArray[Any], NDArray[Any], dict[str, int]]:
    """Split non-manifold edges, fill holes, remesh and decimate, as the options say."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.asarray(vertices, float), np.asarray(faces, np.int32)))
    changes = {"non_manifold_edges": _non_manifold(meshes)}
    if changes["non_manifold_edges"]:
        meshes.meshing_repair_non_manifold_edges()
    before = meshes.current_mesh().face_number()
    if meshes.get_topological_measures()["boundary_edges"]:
        meshes.meshing_close_holes(
            maxholesize=_whole(options, "hole_edges", _HOLE_EDGES), newfaceselected=False
        )
        changes["facets_added_in_holes"] = meshes.current_mesh().face_number() - before
    if "edge_length" in options:
        length = float(options["edge_length"])
        meshes.meshing_isotropic_explicit_remeshing(
            targetlen=pymeshlab.PureValue(length),
            maxsurfdist=pymeshlab.PureValue(float(options.get("deviation", _DEVIATION * length))),
            featuredeg=_CREASE,
        )
        changes["triangles_after_remeshing"] = meshes.current_mesh().face_number()
    if "triangles" in options:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=_whole(options, "triangles", 0),
            preservenormal=True,
            preservetopology=True,
            planarquadric=True,
        )
        changes["triangles_after_decimation"] = meshes.current_mesh().face_number()
    mesh = meshes.current_mesh()
    return (
        np.array(mesh.vertex_matrix(), dtype=np.float64),
        np.array(mesh.face_matrix(), dtype=np.int64),
        changes,
    )


def _non_manifold(meshes: Any) -> int:
    return int(meshes.get_topological_measures()["non_two_manifold_edges"])


def _whole(options: Mapping[str, Any], key: str, default: int) -> int:
    """Option that is a whole number of at least 4."""
    value = options.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or value < 4:
        raise CaseError(f"{key} is {value!r}; expected a whole number of at least 4")
    return value


def load() -> None:
    """Import MeshLab."""
    import pymeshlab  # noqa: F401 - what takes most of the address space


if __name__ == "__main__":
    serve_repairer(mend, load=load)
