"""Shells without the places where they are folded onto themselves, which enclose nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.part._duplicates import facing_pairs
from gradedesign.geometry.part._edges import split_by
from gradedesign.geometry.part._manifold import manifold_shells
from gradedesign.geometry.part._nesting import facet_areas, flat_shells
from gradedesign.geometry.triangles.winding import winding_numbers

#: Beside a fold, solid is looked for this many tolerances away from it, on both sides. Chosen, not
#: measured.
_BESIDE = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unfolded:
    """Closed manifold shells that enclose something."""

    vertices: FloatArray  #: ``(n, 3)``, mm.
    parts: tuple[IntArray, ...]  #: Each ``(k, 3)``. Facets of each shell.
    removed: int  #: Facets in pairs that faced each other.
    notes: tuple[str, ...]


def unfolded_shells(
    vertices: FloatArray, faces: IntArray, *, margin: float, source: str
) -> Unfolded:
    """Cut a surface into manifold shells; facets of a shell that face each other go.

    Facets are compared within a shell alone: those of two bodies that touch stay.

    Raises PartError if the surface does not close.

    ``vertices (n, 3)``, mm. ``faces (m, 3)``: consistently oriented. ``margin``, mm: a shell
    thinner than this encloses nothing.
    """
    points, shells, label = manifold_shells(vertices, faces, tolerance=margin, source=source)
    flat = flat_shells(points, split_by(label, shells), margin)
    sheet = flat[label]
    fold = facing_pairs(faces, label) & ~sheet
    if (sheet | fold).all():  # the caller names a surface that has no volume at all
        sheet, fold = np.zeros_like(sheet), np.zeros_like(fold)
    if fold.any():
        left = faces[~sheet & ~fold]
        points, shells, label = manifold_shells(vertices, left, tolerance=margin, source=source)
    elif sheet.any():
        shells, label = shells[~sheet], label[~sheet]
    solid = points[shells]
    notes = []
    if fold.any():
        notes.append(
            f"{source}: {fold.sum()} facets of one body that face each other were removed"
            + _joined(solid, vertices[faces[fold]], margin)
        )
    if sheet.any():
        notes.append(
            f"{source}: {flat.sum()} closed shells without volume were dropped"
            + _joined(solid, vertices[faces[sheet]], margin)
        )
    parts = [part for part in split_by(label, shells) if len(part)]
    return Unfolded(
        vertices=points, parts=tuple(parts), removed=int(fold.sum()), notes=tuple(notes)
    )


def _joined(solid: FloatArray, sheets: FloatArray, margin: float) -> str:
    """Words on the area of double sheets ``(k, 3, 3)`` on both sides of which there is solid."""
    areas = facet_areas(sheets)
    largest = np.argsort(-areas, kind="stable")
    a, b, c = np.moveaxis(sheets, 1, 0)
    step = np.cross(b - a, c - a) / np.maximum(2.0 * areas, 1e-300)[:, None] * _BESIDE * margin
    middle = sheets.mean(axis=1)
    beside = np.concatenate([(middle + step)[largest], (middle - step)[largest]]).T
    inside = (np.abs(winding_numbers(solid, beside)) > 0.5).reshape(2, -1).all(axis=0)
    area = 0.5 * float(areas[largest][inside].sum())
    return f"; the body touched itself there, and is joined along {area:.5g} mm^2" if area else ""
