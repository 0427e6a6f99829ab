"""Whether a part whose regions are not found was read in the wrong unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from gradedesign.errors import CaseError
from gradedesign.geometry.part.exact_faces import exact_faces
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.raw_triangles import UNIT_MM
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def _unit_that_fits(
    surface: SurfaceMesh,
    specs: Mapping[str, RegionSpec],
    file_faces: FileFaces | None,
    units: str,
) -> str:
    """The unit in which every region of a case is found on a part; empty where none is.

    ``surface``: as read in ``units``, on which a region is not found.
    """
    for other, size in UNIT_MM.items():
        ratio = size / UNIT_MM[units]
        if ratio == 1.0:
            continue
        scaled = replace(surface, vertices=ratio * surface.vertices)
        faces = None if file_faces is None else file_faces.scaled(ratio)
        try:
            if faces is not None and faces.surfaces:
                found = exact_faces(scaled, faces)
            else:
                found = segment_faces(scaled)
            select_regions(scaled, found, specs, faces)
        except CaseError:
            continue
        return other
    return ""


@contextmanager
def questioning_unit(
    surface: SurfaceMesh,
    specs: Mapping[str, RegionSpec],
    file_faces: FileFaces | None,
    units: str | None,
) -> Iterator[None]:
    """Ask for the unit of a part first where its regions are found in another one only.

    ``units``: None where the part was read from no file. Raises `CaseError` of a region that is not
    found, after the question.
    """
    try:
        yield
    except CaseError as error:
        other = "" if units is None else _unit_that_fits(surface, specs, file_faces, units)
        if units is None or not other:
            raise
        edges = np.ptp(surface.vertices, axis=0)
        here, there = (
            " x ".join(f"{edge:.4g}" for edge in edges * UNIT_MM[unit] / UNIT_MM[units])
            for unit in (units, other)
        )
        raise CaseError(
            f'part.units: found "{units}", in which the part is {here} mm; in "{other}" it is '
            f'{there} mm and every region is found: write units = "{other}"? In "{units}", {error}'
        ) from error
