"""Solids of a part's file and the negative volumes that are taken from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import MeshError, PartError
from gradedesign.geometry.part._weld import weld
from gradedesign.geometry.part.file_faces import FileFaces, carried
from gradedesign.geometry.part.repair import WELD_SHARE, build_surface
from gradedesign.geometry.triangles.boolean import LabelledSurface, labelled_difference
from gradedesign.geometry.triangles.common_planes import off_common_planes
from gradedesign.geometry.triangles.surface_mesh import corner_points, enclosed_volume

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
    """Solids as one, from which more negative volumes are to be taken."""
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
    """Whether the boxes of two bodies have a volume in common."""
    low = np.maximum(a.corners.min(axis=(0, 1)), b.corners.min(axis=(0, 1)))
    high = np.minimum(a.corners.max(axis=(0, 1)), b.corners.max(axis=(0, 1)))
    return bool((low < high).all())
