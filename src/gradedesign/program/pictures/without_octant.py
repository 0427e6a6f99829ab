"""A surface without the octant that lies towards the viewer, to look into it."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box
from gradedesign.geometry.triangles.boolean import difference
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Most triangles of a surface whose sections are closed: 2 million take 0.7 GB for a moment.
CAPPED = 2_000_000


def without_octant(
    surface: SurfaceMesh, towards_viewer: FloatArray, *, subject: str
) -> tuple[FloatArray, IntArray, bool]:
    """Vertices and triangles of a surface without an octant about the median of its vertices.

    Most vertices are those of cells: the median lies in the lattice, where the middle of the box
    may lie above it.

    Raises MeshError if the Boolean kernel refuses the surface.

    ``surface``: closed. ``towards_viewer (3,)``: signs of the octant. ``subject``: names the
    surface in messages. Returns ``vertices (n, 3)``, mm; ``faces (m, 3)``; ``capped``: whether the
    sections are closed; those of more than `CAPPED` triangles are not.
    """
    middle = np.median(surface.vertices, axis=0)
    if len(surface.faces) <= CAPPED:
        octant = _octant(surface.vertices, middle, towards_viewer)
        shown = difference(surface, octant, subject=subject)
        return shown.vertices, shown.faces, True
    return *_uncapped(surface, middle, towards_viewer), False


def _octant(vertices: FloatArray, middle: FloatArray, signs: FloatArray) -> SurfaceMesh:
    """Box of vertices, mm, from the middle on, a little beyond it."""
    low, high = corners_of_box(vertices)
    beyond = 0.01 * (high - low)
    start = np.where(signs > 0.0, middle, low - beyond)
    x, y, z = map(float, np.where(signs > 0.0, high + beyond, middle) - start)
    box = box_surface((x, y, z))
    return SurfaceMesh(vertices=box.vertices + start, faces=box.faces)


def _uncapped(
    surface: SurfaceMesh, middle: FloatArray, signs: FloatArray
) -> tuple[FloatArray, IntArray]:
    """The surface cut along the three planes of the octant, plane by plane."""
    from trimesh.intersections import slice_faces_plane

    reaches = (signs * (surface.vertices - middle))[surface.faces].max(axis=1) > 0.0
    inner = reaches.all(axis=1)  # whose box reaches into the octant
    pieces = [(np.asarray(surface.vertices), np.asarray(surface.faces)[~inner])]
    vertices, faces = np.asarray(surface.vertices), np.asarray(surface.faces)[inner]
    for axis in range(3):
        normal = np.where(np.arange(3) == axis, signs, 0.0)
        if len(faces) == 0:
            break
        pieces.append(slice_faces_plane(vertices, faces, -normal, middle)[:2])
        vertices, faces = slice_faces_plane(vertices, faces, normal, middle)[:2]
    starts = np.cumsum([0, *(len(points) for points, _ in pieces)])
    return (
        np.concatenate([points for points, _ in pieces]),
        np.concatenate([corners + n for (_, corners), n in zip(pieces, starts, strict=False)]),
    )
