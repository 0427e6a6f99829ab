"""Triangles of a part that belong to the faces, names and colours of its file."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gradedesign.arrays import BoolArray
from gradedesign.common.values.suggest import instead, listed
from gradedesign.errors import CaseError
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.regions_schema import FILE_KEYS, RegionSpec

#: How many numbers a message lists. Chosen, not measured.
_LISTED = 20


def marked_triangles(spec: RegionSpec, file_faces: FileFaces | None, region: str) -> BoolArray:
    """Triangles ``(m,)`` selected by every key on faces of the file.

    Raises CaseError if the file tells no faces apart, or has no such number, name or colour: lists
    what it has.
    """
    stated_keys = [key for key in FILE_KEYS if getattr(spec, key)]
    if file_faces is None:
        raise CaseError(
            f"region.{region}: {stated_keys[0]} asks for faces of the part's file, but the part is "
            "a box or its format tells none apart; select by plane, cylinder, facing or box"
        )
    fits = np.ones(len(file_faces.label), dtype=bool)
    if spec.face:
        face_numbers = file_faces.numbers
        for number in spec.face:
            if number not in face_numbers:
                raise CaseError(
                    f"region.{region}: the file has no face {number}; "
                    f"{_numbers_in_words(face_numbers)}"
                )
        fits &= np.isin(file_faces.label, spec.face)
    for key, value, file_texts in (
        ("name", spec.name, file_faces.names),
        ("color", spec.color, file_faces.colors),
    ):
        if value is None:
            continue
        numbers = [number for number, text in file_texts.items() if text == value]
        if not numbers:
            near = instead(value, sorted(set(file_texts.values())), label=f"{key}s in the file")
            raise CaseError(
                f"region.{region}: nothing in the part's file has the {key} '{value}'; {near}"
            )
        fits &= np.isin(file_faces.label, numbers)
    if not fits.any():
        raise CaseError(
            f"region.{region}: no face of the part's file has {' and '.join(stated_keys)} at once "
            f"as stated; check lists them"
        )
    return fits


def _numbers_in_words(numbers: Iterable[int]) -> str:
    """List numbers of faces, the first few of them."""
    every = list(numbers)
    more = f" and {len(every) - _LISTED} more" if len(every) > _LISTED else ""
    return f"it has {listed([str(n) for n in every[:_LISTED]])}{more}"
