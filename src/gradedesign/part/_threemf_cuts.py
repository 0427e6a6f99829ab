"""Solids of a 3MF file and the negative volumes that are taken from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import MeshError, PartError
from gradedesign.mesh.boolean import subtracted
from gradedesign.mesh.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.part.file_faces import FileFaces, carried
from gradedesign.part.repair import WELD_SHARE, build_surface, core_diagonal

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
    surface : SurfaceMesh, mm
    """

    number: int
    body: PlacedBody
    surface: SurfaceMesh


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

    Parameters
    ----------
    body : PlacedBody
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
    surface, notes = closed_surface(
        body, scale, f"{source}, '{body.name}', from which negative volumes are taken"
    )
    subject = f"{source}: '{body.name}' and its negative volumes"
    try:
        rest, taken = subtracted(surface, [c.surface for c in body.cutters], subject=subject)
    except MeshError as error:
        raise PartError(f"{error}; cut them in CAD, and export the result") from error
    least = _TOUCHING * enclosed_volume(surface)
    numbers = [cutter.number for cutter in body.cutters]
    cutting = {n for n, volume in zip(numbers, taken, strict=True) if volume > least}
    if rest is None or not cutting:
        return None if rest is None else replace(body, cutters=()), cutting, notes
    bodies = (body, *(cutter.body for cutter in body.cutters))
    corners = scale * np.concatenate([each.corners for each in bodies])
    faces = carried(
        FileFaces(label=np.concatenate([each.label for each in bodies])),
        corners,
        rest,
        tolerance=10.0 * WELD_SHARE * core_diagonal(corners),
    )
    left = PlacedBody(name=body.name, corners=corner_points(rest) / scale, label=faces.label)
    return left, cutting, notes


def closed_surface(
    body: PlacedBody, scale: float, source: str
) -> tuple[SurfaceMesh, tuple[str, ...]]:
    """Closed surface of a body that cuts or is cut, mm, and remarks on its repair.

    Raises
    ------
    PartError
        If the body is damaged.
    """
    try:
        surface, report = build_surface(scale * body.corners, bodies="all", source=source)
    except PartError as error:
        raise PartError(
            f'{error} (negative volumes are taken away before repair = "auto" could mend it)'
        ) from error
    return surface, report.warnings


def meet(a: PlacedBody, b: PlacedBody) -> bool:
    """Whether the boxes of two bodies have a volume in common."""
    low = np.maximum(a.corners.min(axis=(0, 1)), b.corners.min(axis=(0, 1)))
    high = np.minimum(a.corners.max(axis=(0, 1)), b.corners.max(axis=(0, 1)))
    return bool((low < high).all())
