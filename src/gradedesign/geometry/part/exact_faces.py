"""Smooth faces of a part whose file states the surface of every face: taken over, not fitted.

Faces of the file that share an edge and a surface are one, as the two halves of a hole are.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.part._edges import face_edges, linked_sets, split_by
from gradedesign.geometry.part._face_fits import covered_angle
from gradedesign.geometry.part.exact_surface import ExactSurface
from gradedesign.geometry.part.file_faces import NO_FACE, FileFaces
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces, mean_normal
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points

#: Surfaces of faces that meet are one where they agree this well: sine of an angle, and lengths as
#: a share of the part's diagonal. Chosen, not measured.
_SAME_ANGLE, _SAME_PLACE = 1e-5, 1e-6
_OTHER = ExactSurface(kind="other")


def exact_faces(surface: SurfaceMesh, file_faces: FileFaces) -> SmoothFaces:
    """Smooth faces from the surfaces that the part's file states.

    ``file_faces``: on that surface, with ``surfaces``; triangles of no face become faces of kind
    ``other``.
    """
    pairs = face_edges(surface.faces).pairs
    vectors = area_vectors(surface)
    group = _groups(surface, file_faces, pairs, vectors)
    inner = pairs[group[pairs[:, 0]] == group[pairs[:, 1]]]
    size = len(surface.faces)
    parts = linked_sets(inner.T, size)
    first, index = np.unique(parts, return_index=True, return_inverse=True)[1:]
    rank = np.argsort(np.argsort(first))
    label = rank[index.ravel()].astype(np.int64)
    return SmoothFaces(
        label=label,
        faces=tuple(
            _face(surface, file_faces.surfaces.get(int(file_faces.label[own[0]]), _OTHER), own)
            for own in split_by(label, np.arange(size))
        ),
    )


def _groups(
    surface: SurfaceMesh, file_faces: FileFaces, pairs: IntArray, vectors: FloatArray
) -> IntArray:
    """Number of every triangle ``(m,)`` that faces on one surface that meet have in common."""
    tolerance = _SAME_PLACE * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    meeting = np.unique(np.sort(file_faces.label[pairs], axis=1), axis=0)
    home = {number: number for number in (NO_FACE, *file_faces.numbers)}
    planes = _planes(surface, file_faces, vectors)

    def root(number: int) -> int:
        while home[number] != number:
            number = home[number]
        return number

    for a, b in meeting[meeting[:, 0] != meeting[:, 1]].tolist():
        surface_a, surface_b = (file_faces.surfaces.get(n, _OTHER) for n in (a, b))
        if NO_FACE in (a, b) or surface_a.kind != surface_b.kind or surface_a.kind == "other":
            continue
        if surface_a.kind == "cylinder":
            same = _one_cylinder(surface_a, surface_b, tolerance)
        else:
            (na, da), (nb, db) = planes[a], planes[b]
            same = bool(na @ nb > 0.0 and np.linalg.norm(np.cross(na, nb)) < _SAME_ANGLE)
            same = same and abs(da - db) < tolerance
        if same:
            home[root(b)] = root(a)
    numbers, index = np.unique(file_faces.label, return_inverse=True)
    return np.array([root(n) for n in numbers.tolist()])[index.ravel()]


def _planes(
    surface: SurfaceMesh, file_faces: FileFaces, vectors: FloatArray
) -> dict[int, tuple[FloatArray, float]]:
    """Outward normal of every flat face, and the largest coordinate of its corners along it."""
    result = {}
    corners = corner_points(surface)
    for number, entry in file_faces.surfaces.items():
        own = file_faces.label == number
        if entry.kind == "plane" and own.any():
            normal = vectors[own].sum(axis=0)
            normal /= max(float(np.linalg.norm(normal)), 1e-300)
            result[number] = normal, float((corners[own] @ normal).max())
    return result


def _one_cylinder(first: ExactSurface, second: ExactSurface, tolerance: float) -> bool:
    """Whether two cylinders are the same, either way along their axis."""
    if first.placed is None or second.placed is None:
        return False
    (axis, point, diameter), (second_axis, elsewhere, width) = first.placed, second.placed
    return bool(
        np.linalg.norm(np.cross(axis, second_axis)) < _SAME_ANGLE
        and np.linalg.norm(np.cross(elsewhere - point, axis)) < tolerance
        and abs(diameter - width) < tolerance
    )


def _face(surface: SurfaceMesh, entry: ExactSurface, own: IntArray) -> SmoothFace:
    """Measure one face, of these triangles."""
    corners = corner_points(surface)[own]
    vectors = area_vectors(surface)[own]
    areas = np.linalg.norm(vectors, axis=1)
    total = float(areas.sum())
    centres = corners.mean(axis=1)
    axis = point = diameter = concave = span = None
    if entry.placed is not None:
        axis, start, diameter = entry.placed
        axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
        along = (corners.reshape(-1, 3) - start) @ axis
        point = start + 0.5 * (along.min() + along.max()) * axis
        outward = centres - start
        outward = outward - np.outer(outward @ axis, axis)
        concave = bool((outward * vectors).sum() < 0.0)
        span = covered_angle(corners, axis, point)
    return SmoothFace(
        kind=entry.kind,
        area=total,
        centroid=areas @ centres / total,
        normal=mean_normal(vectors.sum(axis=0), total),
        axis=axis,
        point=point,
        diameter=diameter,
        concave=concave,
        span=span,
    )
