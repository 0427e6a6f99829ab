"""Intersection and difference of two closed surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def intersection(
    first: SurfaceMesh, second: SurfaceMesh, *, subject: str, shortest: float = 0.0
) -> SurfaceMesh:
    """Closed surface of the volume that both enclose.

    ``first``, ``second``: closed, manifold, outward oriented. ``subject``: names the result in
    messages. ``shortest``, mm: edges shorter than this are collapsed where the surface hardly
    moves. Raises `MeshError` if the Boolean kernel refuses a surface, or nothing is left.
    """
    # The kernel holds the interpreter's lock in each of its calls.
    report_step("reading the surfaces", blocking=True)
    solids = _manifold(first, subject), _manifold(second, subject)
    report_step("intersection", blocking=True)
    common = solids[0] ^ solids[1]
    empty = common.is_empty()  # the kernel evaluates lazily
    if shortest > 0 and not empty:
        report_step("collapsing short edges", blocking=True)
        common = common.as_original().simplify(shortest)
    return _surface_of(common, f"{subject}: the two solids have no material in common")


def difference(first: SurfaceMesh, second: SurfaceMesh, *, subject: str) -> SurfaceMesh:
    """Closed surface of the volume that the first encloses and the second does not.

    ``first``, ``second``: closed, manifold, outward oriented. ``subject``: names the result in
    messages. Raises `MeshError` if the Boolean kernel refuses a surface, or nothing is left.
    """
    report_step("reading the surfaces", blocking=True)
    solids = _manifold(first, subject), _manifold(second, subject)
    report_step("difference", blocking=True)
    words = f"{subject}: nothing of the first solid lies outside the second"
    return _surface_of(solids[0] - solids[1], words)


#: Tolerance of the first pass of `fewer_triangles` over the surface's diagonal, and how much more
#: each time: passes over a lattice cost more than triangles gain. Chosen, not measured.
_FIRST, _MORE = 2e-4, 1.4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledSurface:
    """A closed surface and a number for each of its triangles."""

    surface: SurfaceMesh
    label: IntArray  #: ``(m,)``. -1 or more.


def labelled_difference(
    first: LabelledSurface, second: LabelledSurface, *, subject: str
) -> LabelledSurface | None:
    """Closed surface of the volume that the first encloses and the second does not.

    Triangles keep the numbers of those they are parts of, and lines between numbers stay.

    Returns LabelledSurface or None: none where nothing is left. Raises MeshError if the Boolean
    kernel refuses a surface.

    ``first``, ``second``: closed, manifold, outward oriented. ``subject``: names the result in
    messages.
    """
    report_step("reading the surfaces", blocking=True)
    solids = [_manifold(each.surface, subject, label=each.label) for each in (first, second)]
    report_step("difference", blocking=True)
    mesh = (solids[0] - solids[1]).to_mesh64()
    faces = np.asarray(mesh.tri_verts).astype(np.int64)
    if len(faces) == 0:
        return None
    surface = SurfaceMesh(vertices=np.asarray(mesh.vert_properties)[:, :3], faces=faces)
    return LabelledSurface(surface=surface, label=np.asarray(mesh.face_id).astype(np.int64) - 1)


def fewer_triangles(surface: SurfaceMesh, most: int, *, subject: str) -> SurfaceMesh:
    """Surface of at most so many triangles, on some of its vertices, for pictures.

    The kernel merges what lies within a tolerance of edges and planes, which grows until few enough
    are left; how far that is from the surface is for the caller to measure. Unlike `within_chord`
    it may let triangles pass through others, and takes a twentieth of its time.

    Raises MeshError if the Boolean kernel refuses the surface, or nothing is left of it.
    """
    solid = _manifold(surface, subject)
    tolerance = _FIRST * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    while solid.num_tri() > most:
        report_step(f"fewer triangles: {solid.num_tri()} of {len(surface.faces)}", blocking=True)
        solid = solid.simplify(tolerance)
        tolerance *= _MORE
    return _surface_of(solid, f"{subject}: nothing is left of it")


def _surface_of(solid: Any, if_empty: str) -> SurfaceMesh:
    """Surface of a solid of the Boolean kernel; raise with the given words if empty."""
    mesh = solid.to_mesh64()
    faces = np.asarray(mesh.tri_verts).astype(np.int64)
    if len(faces) == 0:
        raise MeshError(if_empty)
    return SurfaceMesh(vertices=np.asarray(mesh.vert_properties)[:, :3], faces=faces)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CutPiece:
    """A capped surface after a cut, without its caps."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    faces: IntArray  #: ``(m, 3)``. Open where the caps were.
    source: IntArray  #: ``(n,)``. Vertex of the capped surface where a cap met it, else -1.


def cut_capped(
    vertices: FloatArray, faces: IntArray, caps: int, second: SurfaceMesh, *, subject: str
) -> CutPiece:
    """Intersection of a solid with another that keeps some of its triangles unchanged.

    Raises MeshError if the Boolean kernel refuses a surface, changes a cap, or nothing is left.

    - ``vertices (n, 3)``, mm
    - ``faces (m, 3)``: closed, manifold, outward oriented; the last ones are the caps
    - ``caps``: their number. They lie inside the second solid, away from its surface.
    - ``subject``: names the result in messages
    """
    from manifold3d import Manifold

    report_step("reading the surfaces", blocking=True)
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    packed = (np.cumsum(used) - 1)[faces]
    mark = Manifold.reserve_ids(1)
    first = _manifold(SurfaceMesh(vertices=vertices[used], faces=packed), subject, mark)
    solids = first, _manifold(second, subject)
    report_step("intersection", blocking=True)
    mesh = (solids[0] ^ solids[1]).to_mesh64()
    triangles = np.asarray(mesh.tri_verts).astype(np.int64)
    if len(triangles) == 0:
        raise MeshError(f"{subject}: the two solids have no material in common")
    owner = np.repeat(mesh.run_original_id, np.diff(np.asarray(mesh.run_index).astype(int)) // 3)
    face = np.asarray(mesh.face_id).astype(np.int64)
    is_cap = (owner == mark) & (face >= len(faces) - caps)
    points = np.asarray(mesh.vert_properties)[:, :3]
    source = np.full(len(points), -1, dtype=np.int64)
    unchanged, same = 0, faces[face[is_cap]]
    for turn in range(3):  # the kernel may start a triangle at another corner
        corners = np.roll(same, turn, axis=1)
        equal = (points[triangles[is_cap]] == vertices[corners]).all(axis=(1, 2))
        source[triangles[is_cap][equal]] = corners[equal]
        unchanged += int(np.count_nonzero(equal))
    if unchanged != caps:
        raise MeshError(
            f"{subject}: the Boolean kernel changed {caps - unchanged} of {caps} triangles that "
            f"lie inside the part; use another grid step"
        )
    return CutPiece(vertices=points, faces=triangles[~is_cap], source=source)


def _manifold(
    surface: SurfaceMesh, subject: str, mark: int | None = None, label: IntArray | None = None
) -> Any:
    """The kernel's solid; with a mark, a result names its triangles by mark and number.

    With labels it names them by these, and keeps the edges between them.
    """
    from manifold3d import Manifold, Mesh64

    count = len(surface.faces)
    labels: dict[str, Any] = {}
    if mark is not None:
        labels = {
            "run_original_id": np.array([mark], dtype=np.uint32),
            "run_index": np.array([0, 3 * count], dtype=np.uint64),
            "face_id": np.arange(count, dtype=np.uint64),
        }
    if label is not None:
        labels = {"face_id": (label + 1).astype(np.uint64)}
    # The kernel takes only writeable arrays.
    solid = Manifold(
        Mesh64(
            vert_properties=np.array(surface.vertices),
            tri_verts=surface.faces.astype(np.uint64),
            **labels,
        )
    )
    if solid.status().name != "NoError":
        raise MeshError(
            f"{subject}: a surface of {len(surface.faces)} triangles cannot be cut, the Boolean "
            f"kernel reports {solid.status().name}; it must be closed and manifold"
        )
    return solid
