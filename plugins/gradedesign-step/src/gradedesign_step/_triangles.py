"""Triangles of CAD faces that close without a gap, and the surfaces that the faces lie on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane
from OCP.gp import gp_Cylinder, gp_Pln
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign_step._solids import SEWING_MM, CadSolids, FileRefused

#: Chord tolerance where none is stated, as a share of the diagonal.
_DEFAULT_SHARE = 1e-4
#: Facets of one face turn against each other by no more than this, radians: 12 degrees.
_TURN = 0.21
#: A free-form face within this share of the diagonal of a plane or a cylinder is one.
_SAME_SURFACE = 1e-6
#: Volumes of triangles and exact faces differ by no more than this share, and the chords.
_SAME_VOLUME = 0.002
#: More triangles than this are no part that can be repaired and meshed.
_MOST_TRIANGLES = 20_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CadTriangles:
    """Triangles of all faces in mm, the face of each counted from 1, and the faces' surfaces."""

    corners: NDArray[np.float64]
    label: NDArray[np.int64]
    surfaces: dict[int, dict[str, Any]]
    chord_tolerance: float


def triangulate(solids: CadSolids, chord_tolerance: float | None) -> CadTriangles:
    """Triangulate all faces; edges are divided once for both their faces.

    Raises
    ------
    FileRefused
        If a face cannot be triangulated, or the triangles do not close.
    """
    diagonal = _diagonal(solids.shape)
    tolerance = _DEFAULT_SHARE * diagonal if chord_tolerance is None else chord_tolerance
    BRepMesh_IncrementalMesh(solids.shape, tolerance, False, _TURN, False)
    meshes = []
    for number, face in enumerate(solids.faces, 1):
        mesh = _face_mesh(face.shape)
        if mesh is None:
            raise FileRefused(
                f"face {number} of {len(solids.faces)} cannot be triangulated; repair it in CAD, "
                "or state another [part] chord_tolerance"
            )
        meshes.append(mesh)
    nodes, start = _joined([face.shape for face in solids.faces], meshes, tolerance)
    index = np.concatenate([mesh.index + k for mesh, k in zip(meshes, start, strict=True)])
    if len(index) > _MOST_TRIANGLES:
        raise FileRefused(f"{len(index)} triangles; state a larger [part] chord_tolerance")
    label = np.repeat(np.arange(1, len(meshes) + 1), [len(mesh.index) for mesh in meshes])
    corners = nodes[index]
    with_area = _with_area(corners)
    result = CadTriangles(
        corners=corners[with_area],
        label=label[with_area],
        surfaces={
            number: _surface(face.shape, _SAME_SURFACE * diagonal)
            for number, face in enumerate(solids.faces, 1)
        },
        chord_tolerance=tolerance,
    )
    _require_closed(result)
    _require_volume(result, solids.shape)
    return result


def _diagonal(shape: Any) -> float:
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        raise FileRefused("its faces have no extent; export the part as a solid")
    return float(np.sqrt(box.SquareExtent()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _FaceMesh:
    """Triangles of one face: ``index`` (m, 3) outward into ``nodes`` (n, 3), mm."""

    nodes: NDArray[np.float64]
    index: NDArray[np.int64]
    source: Any
    location: Any


def _face_mesh(face: Any) -> _FaceMesh | None:
    """Triangles of a face; None where it has none."""
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(TopoDS.Face(face), location)
    if mesh is None or mesh.NbTriangles() == 0:
        return None
    points = (mesh.Node(k) for k in range(1, mesh.NbNodes() + 1))
    nodes = np.array([(p.X(), p.Y(), p.Z()) for p in points])
    triangles = (mesh.Triangle(k) for k in range(1, mesh.NbTriangles() + 1))
    index = np.array([t.Get() for t in triangles], dtype=np.int64) - 1
    move = location.Transformation()
    if not location.IsIdentity():
        matrix = np.array([[move.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)])
        nodes = nodes @ matrix[:, :3].T + matrix[:, 3]
    if (face.Orientation() == TopAbs_REVERSED) != move.IsNegative():
        index = index[:, ::-1]
    return _FaceMesh(nodes=nodes, index=index, source=mesh, location=location)


def _joined(
    faces: list[Any], meshes: list[_FaceMesh], tolerance: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes of all faces, those on common edges in one place, and where each face's begin.

    Every edge is divided once for all its faces, but where a file's edges lie a little off its
    faces, each face has its own points there.
    """
    start = np.concatenate([[0], np.cumsum([len(mesh.nodes) for mesh in meshes])])
    nodes = np.concatenate([mesh.nodes for mesh in meshes])
    places = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    first: dict[int, NDArray[np.int64]] = {}
    pairs: list[NDArray[np.int64]] = []
    for face, mesh, offset in zip(faces, meshes, start, strict=False):
        explorer = TopExp_Explorer(face, TopAbs_EDGE)
        while explorer.More():
            edge = TopoDS.Edge(explorer.Current())
            explorer.Next()
            divided = BRep_Tool.PolygonOnTriangulation_s(edge, mesh.source, mesh.location)
            if divided is None:
                continue
            own = np.array([divided.Node(k) for k in range(1, divided.NbNodes() + 1)])
            own += int(offset) - 1
            along = TopoDS.Edge(edge.Oriented(TopAbs_FORWARD))
            ends = [TopExp.FirstVertex_s(along), TopExp.LastVertex_s(along)]
            for key, part in (
                (places.Add(edge), own),
                (places.Add(ends[0]), own[:1]),
                (places.Add(ends[1]), own[-1:]),
            ):
                first_nodes = first.setdefault(key, part)
                if len(first_nodes) == len(part):
                    pairs.append(np.stack([first_nodes, part], axis=1))
    links = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=(len(nodes),) * 2)
    group = connected_components(graph, directed=False)[1]
    places_of = nodes[np.unique(group, return_index=True)[1]][group]
    gap = float(np.linalg.norm(places_of - nodes, axis=1).max())
    if gap > max(tolerance, SEWING_MM):
        raise FileRefused(
            f"its faces do not meet: edges lie up to {gap:.3g} mm apart; repair the solid in CAD, "
            "or state a larger [part] chord_tolerance"
        )
    return places_of, start[:-1]


def _with_area(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Triangles with three different corners; at a pole of a sphere some have two."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray((a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1))


def _require_closed(mesh: CadTriangles) -> None:
    """Refuse triangles of which an edge is not shared by two, turned the same way."""
    flat = mesh.corners.reshape(-1, 3) + 0.0
    index = np.unique(flat, axis=0, return_inverse=True)[1].reshape(-1, 3)
    ahead = np.roll(index, -1, axis=1)
    size = int(index.max()) + 1
    forward, backward = np.sort((index * size + ahead).ravel()), (ahead * size + index).ravel()
    lonely = ~np.isin(backward, forward).reshape(-1, 3).all(axis=1)
    if lonely.any() or not np.array_equal(forward, np.sort(backward)):
        faces = sorted(set(mesh.label[lonely].tolist()))[:8]
        at = mesh.corners[np.flatnonzero(lonely)[:1]].reshape(-1, 3).mean(axis=0)
        raise FileRefused(
            f"its faces do not close: {np.count_nonzero(lonely)} triangles have an edge of their "
            f"own, on faces {', '.join(map(str, faces))}, the first near "
            f"({', '.join(f'{v:.4g}' for v in at)}) mm; repair the solid in CAD"
        )


def _require_volume(mesh: CadTriangles, shape: Any) -> None:
    """Refuse triangles that enclose another volume than the exact faces."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    exact = float(properties.Mass())
    a, b, c = np.moveaxis(mesh.corners - mesh.corners.mean(axis=(0, 1)), 1, 0)
    volume = float((a * np.cross(b, c)).sum()) / 6.0
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    if not abs(volume - exact) <= _SAME_VOLUME * abs(exact) + mesh.chord_tolerance * area:
        raise FileRefused(
            f"its triangles enclose {volume:.6g} mm^3, its exact faces {exact:.6g} mm^3; heal the "
            "part in CAD, or state a smaller [part] chord_tolerance"
        )


def _surface(face: Any, tolerance: float) -> dict[str, Any]:
    """Kind, and of a cylinder the axis, a point on it and the diameter in mm."""
    adaptor = BRepAdaptor_Surface(TopoDS.Face(face))
    kind = adaptor.GetType()
    if kind == GeomAbs_Plane:
        return {"kind": "plane"}
    if kind == GeomAbs_Cylinder:
        return _cylinder(adaptor.Cylinder())
    form = ShapeAnalysis_CanonicalRecognition(face)
    plane, cylinder = gp_Pln(), gp_Cylinder()
    if form.IsPlane(tolerance, plane):
        return {"kind": "plane"}
    if form.IsCylinder(tolerance, cylinder):
        return _cylinder(cylinder)
    return {"kind": "other"}


def _cylinder(cylinder: Any) -> dict[str, Any]:
    axis = cylinder.Axis()
    point, direction = axis.Location(), axis.Direction()
    return {
        "kind": "cylinder",
        "axis": [direction.X(), direction.Y(), direction.Z()],
        "point": [point.X(), point.Y(), point.Z()],
        "diameter": 2.0 * cylinder.Radius(),
    }
