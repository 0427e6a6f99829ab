"""Solids of a part's file and the negative volumes that are taken from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import MeshError, PartError
from gradedesign.geometry.part._weld import weld
from gradedesign.geometry.part.file_faces import FileFaces, carried
from gradedesign.geometry.part.repair import WELD_SHARE, build_surface
from gradedesign.geometry.triangles.boolean import LabelledSurface, labelled_difference
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    corner_points,
    enclosed_volume,
)

#: A negative volume that takes less than this share of a solid only touches it: rounding of
#: coordinates, far below what any file means.
_TOUCHING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedBody:
    """A solid where it is placed.

    Attributes
    ----------
    name : str
        For messages.
    corners : (m, 3 corners, 3 coordinates) array, file units
    label : (m,) int array
        Number of the face of every triangle.
    cutters : tuple of Cutter
        Negative volumes that are to be taken from it, in their order.
    """

    name: str
    corners: FloatArray
    label: IntArray
    cutters: tuple[Cutter, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cutter:
    """A body of a negative volume.

    Attributes
    ----------
    number : int
        Of the negative volume among the roles of the file.
    body : PlacedBody
        Itself cut already.
    closed : LabelledSurface, mm
        Its surface with the numbers of its faces.
    """

    number: int
    body: PlacedBody
    closed: LabelledSurface


def cut_together(bodies: Sequence[PlacedBody], cutters: Sequence[Cutter]) -> PlacedBody:
    """Solids as one, from which more negative volumes are to be taken.

    Examples
    --------
    >>> from gradedesign.geometry.part.box import box_surface
    >>> from gradedesign.geometry.triangles.surface_mesh import corner_points
    >>> corners = corner_points(box_surface((1.0, 1.0, 1.0)))
    >>> label = np.zeros(12, dtype=np.int64)
    >>> cube = PlacedBody(name="cube", corners=corners, label=label)
    >>> hole = PlacedBody(name="hole", corners=corners + 0.5, label=label)
    >>> cutter = Cutter(number=1, body=hole, closed=closed_body(hole, 10.0, "a.3mf")[0])
    >>> len(cut_together([cube], [cutter]).cutters)
    1
    """
    return PlacedBody(
        name=" and ".join(dict.fromkeys(body.name for body in bodies)),
        corners=np.concatenate([body.corners for body in bodies]),
        label=np.concatenate([body.label for body in bodies]),
        cutters=(*(cutter for body in bodies for cutter in body.cutters), *cutters),
    )


def without_cutters(
    body: PlacedBody, scale: float, source: str
) -> tuple[PlacedBody | None, set[int], tuple[str, ...]]:
    """Take the negative volumes of a solid away from it.

    Faces of both that lie on one plane within the tolerance of welding are flush there.

    Parameters
    ----------
    scale : float, mm
        A unit of the file.
    source : str
        Name of the file, for messages.

    Returns
    -------
    rest : PlacedBody or None
        None where nothing is left.
    cutting : set of int
        Numbers of the negative volumes that took something.
    notes : tuple of str
        Remarks on repairs before.

    Raises
    ------
    PartError
        If the solid is damaged, or touches itself so that it cannot be cut.

    Examples
    --------
    >>> from gradedesign.geometry.part.box import box_surface
    >>> from gradedesign.geometry.triangles.surface_mesh import corner_points
    >>> corners = corner_points(box_surface((1.0, 1.0, 1.0)))
    >>> label = np.zeros(12, dtype=np.int64)
    >>> cube = PlacedBody(name="cube", corners=corners, label=label)
    >>> hole = PlacedBody(name="hole", corners=corners + 0.5, label=label)
    >>> cutter = Cutter(number=1, body=hole, closed=closed_body(hole, 10.0, "a.3mf")[0])
    >>> rest, cutting, _ = without_cutters(cut_together([cube], [cutter]), 10.0, "a.3mf")
    >>> cutting
    {1}
    """
    rest, notes = closed_body(
        body, scale, f"{source}, '{body.name}', from which negative volumes are taken"
    )
    subject = f"{source}: '{body.name}' and its negative volumes"
    flush = WELD_SHARE * float(np.linalg.norm(np.ptp(rest.surface.vertices, axis=0)))
    volume = enclosed_volume(rest.surface)
    least, cutting = _TOUCHING * volume, set[int]()
    for cutter in body.cutters:
        moved = off_common_planes(cutter.closed.surface, rest.surface, distance=flush)
        tool = replace(cutter.closed, surface=moved)
        try:
            left = labelled_difference(rest, tool, subject=subject)
        except MeshError as error:
            raise PartError(f"{error}; cut them in CAD, and export the result") from error
        before, volume = volume, 0.0 if left is None else enclosed_volume(left.surface)
        if before - volume > least:
            cutting.add(cutter.number)
        if left is None:
            return None, cutting, notes
        rest = left
    if not cutting:
        return replace(body, cutters=()), cutting, notes
    # Edges of the cutter pass beside its corners at this distance where it was moved.
    vertices, faces, _ = weld(corner_points(rest.surface), 2.0 * flush, source)
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    corners = vertices[faces[whole]] / scale
    return PlacedBody(name=body.name, corners=corners, label=rest.label[whole]), cutting, notes


def closed_body(
    body: PlacedBody, scale: float, source: str
) -> tuple[LabelledSurface, tuple[str, ...]]:
    """Closed surface of a body that cuts or is cut, mm, and remarks on its repair.

    Raises
    ------
    PartError
        If the body is damaged.

    Examples
    --------
    >>> from gradedesign.geometry.part.box import box_surface
    >>> from gradedesign.geometry.triangles.surface_mesh import corner_points, enclosed_volume
    >>> corners = corner_points(box_surface((1.0, 1.0, 1.0)))
    >>> body = PlacedBody(name="cube", corners=corners, label=np.zeros(12, dtype=np.int64))
    >>> closed, notes = closed_body(body, 10.0, "cube.stl")  # in cm
    >>> round(enclosed_volume(closed.surface), 6), notes
    (1000.0, ())
    """
    corners = scale * body.corners
    try:
        surface, report = build_surface(corners, bodies="all", source=source)
    except PartError as error:
        raise PartError(
            f'{error} (negative volumes are taken away before repair = "auto" could mend it)'
        ) from error
    tolerance = 10.0 * report.weld_tolerance
    faces = carried(FileFaces(label=body.label), corners, surface, tolerance=tolerance)
    # Whether bodies that touch stay apart is judged, and said, for the whole part.
    notes = (note for note in report.warnings if not note.endswith('(bodies = "all")'))
    return LabelledSurface(surface=surface, label=faces.label), tuple(notes)


def meet(a: PlacedBody, b: PlacedBody) -> bool:
    """Whether the boxes of two bodies have a volume in common.

    Examples
    --------
    >>> from gradedesign.geometry.part.box import box_surface
    >>> from gradedesign.geometry.triangles.surface_mesh import corner_points
    >>> corners = corner_points(box_surface((1.0, 1.0, 1.0)))
    >>> label = np.zeros(12, dtype=np.int64)
    >>> bodies = [PlacedBody(name="", corners=corners + x, label=label) for x in (0.0, 0.5, 2.0)]
    >>> meet(bodies[0], bodies[1]), meet(bodies[0], bodies[2])
    (True, False)
    """
    low = np.maximum(a.corners.min(axis=(0, 1)), b.corners.min(axis=(0, 1)))
    high = np.minimum(a.corners.max(axis=(0, 1)), b.corners.max(axis=(0, 1)))
    return bool((low < high).all())


#: Angle up to which two facets may lie on one plane, rad; their corners decide. Chosen, not
#: measured.
_PARALLEL = 1e-4
#: Planes of a vertex whose directions differ less than this are one for its shift: rounding of
#: facets, beside edges of 1 degree and more.
_SAME_DIRECTION = 1e-3


def off_common_planes(cutter: SurfaceMesh, body: SurfaceMesh, *, distance: float) -> SurfaceMesh:
    """Cutter whose faces on planes of a body's faces lie a little outside of the body.

    A cutter that ends flush with a face of the body ends above or below it by rounding, which
    leaves a film there or patches of one. Moved outward, the cutter reaches through, and one that
    only touches the body no longer does.

    ``cutter``, ``body``, mm: closed, outward oriented. ``distance``, mm: a facet of the cutter lies
    on a plane if its corners are no farther from it; they are moved to this distance outside.
    """
    middle = 0.5 * (body.vertices.min(axis=0) + body.vertices.max(axis=0))
    reach = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    facets, normal, offset = _planes(body, middle, distance)
    own_facets, own_normal, own_offset = _planes(cutter, middle, distance)
    tree = cKDTree(np.column_stack([reach * normal, offset]))
    points = np.column_stack([reach * own_normal, own_offset])
    near = [tree.query_ball_point(sign * points, _PARALLEL * reach) for sign in (1.0, -1.0)]
    low, high = _boxes(body, facets)
    own_low, own_high = _boxes(cutter, own_facets)
    corners = corner_points(cutter)[own_facets] - middle
    wanted: dict[int, list[int]] = {}
    for k, found in enumerate(map(list.__add__, *near)):
        planes = np.array(found, dtype=np.int64)
        off = np.abs(corners[k] @ normal[planes].T - offset[planes]).max(axis=0)
        meet = (own_low[k] <= high[planes] + distance) & (low[planes] <= own_high[k] + distance)
        for vertex in cutter.faces[own_facets[k]].tolist():
            wanted.setdefault(vertex, []).extend(planes[meet.all(axis=1) & (off <= distance)])
    vertices = np.array(cutter.vertices)
    for vertex, shared in wanted.items():
        plane = np.unique(shared).astype(np.int64)
        lack = distance - (normal[plane] @ (vertices[vertex] - middle) - offset[plane])
        shift = np.linalg.lstsq(normal[plane], lack, rcond=_SAME_DIRECTION)[0]
        vertices[vertex] += shift
    return SurfaceMesh(vertices=vertices, faces=cutter.faces)


def _planes(
    surface: SurfaceMesh, middle: FloatArray, distance: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Facets broad enough to have a direction, their normals, and distances from the middle."""
    corners = corner_points(surface) - middle
    area = area_vectors(surface)
    size = np.linalg.norm(area, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    facets = np.flatnonzero(2.0 * size > distance * longest)
    normal = area[facets] / size[facets, None]
    return facets, normal, np.einsum("ij,ij->i", normal, corners[facets].mean(axis=1))


def _boxes(surface: SurfaceMesh, facets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corners of facets' boxes, ``(k, 3)``."""
    corners = corner_points(surface)[facets]
    return corners.min(axis=1), corners.max(axis=1)
