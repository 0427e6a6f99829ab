"""The as-built body of a printed file, measured, and the process of a case that builds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import BoolArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.direction import FRAMES
from gradedesign.design.printing.as_built import (
    Building,
    Compensated,
    as_built_surface,
    building_on,
    compensated_surface,
)
from gradedesign.design.printing.process import Process
from gradedesign.geometry.triangles.offset_surface import facet_normals
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    corner_points,
    enclosed_volume,
)
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles
from gradedesign.mechanics.material.material import Material

#: A facet lies on a face of the part where its middle is within this share of its size from it, as
#: triangles cut off the part's are, and the cosine of their normals is at least the second. From
#: 1e-4 to 0.1 the area of such facets of `mini` and `bracket` changes by 0.5 %; walls of the
#: lattice may lie along a face of the part, in long triangles not far below it.
_ON_FACE, _ALIKE = 1e-3, 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedProcess:
    """A process with what the case asks of it."""

    process: Process
    direction: str = "+z"  #: Of the part, that points upwards in the printer.
    judged: str = "both"  #: "nominal", "as_built" or "both". Body that must meet the limits.
    compensate: bool = False  #: Whether the file is offset beforehand.
    variants: int = 0  #: Random bodies to analyse.
    seed: int = 2027


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AsBuiltBody:
    """The body that is built of a printed file."""

    stated: StatedProcess
    building: Building
    designed: SurfaceMesh
    file: SurfaceMesh  #: That is printed: the designed surface, or its compensated one.
    surface: SurfaceMesh  #: That is built of it.
    compensated: Compensated | None = None  #: Where the case asks for it.

    def variant(self, number: int) -> SurfaceMesh:
        """One as-built surface of many by its number from 1: waviness and scatter drawn anew."""
        seed = self.stated.seed + number
        return as_built_surface(self.file, self.building, seed, scattered=True)


def as_built_body(
    stated: StatedProcess | None, surface: SurfaceMesh, part: SurfaceMesh, strut: float
) -> AsBuiltBody | None:
    """The body that a process builds of a printed surface; None where nothing is known of it.

    ``part``: whose faces keep their place, see `Building`. ``strut``, mm: length over which the
    width of struts is alike: half a cell.
    """
    if stated is None or not stated.process.has_body:
        return None
    report_step("as-built body")
    up = np.array(FRAMES[stated.direction][2], dtype=np.float64)
    building = building_on(surface, stated.process, up, _facets_on(surface, part), strut)
    compensated = compensated_surface(surface, building) if stated.compensate else None
    file = surface if compensated is None else compensated.surface
    return AsBuiltBody(
        stated=stated,
        building=building,
        designed=surface,
        file=file,
        surface=as_built_surface(file, building, stated.seed),
        compensated=compensated,
    )


def _facets_on(surface: SurfaceMesh, part: SurfaceMesh) -> BoolArray:
    """Facets of a surface that lie on faces of the part, ``(m,)``."""
    triangles, corners = corner_points(part), corner_points(surface)
    size = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    gap, nearest, _ = closest_triangles(build_triangle_tree(triangles), corners.mean(axis=1).T)
    alike = np.einsum("mi,mi->m", facet_normals(surface), facet_normals(part)[nearest])
    return np.asarray((gap <= _ON_FACE * size) & (alike >= _ALIKE))


def process_warnings(
    stated: StatedProcess | None,
    material: Material | None,
    widths: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Sentences on what is not known of a process, or what it was not measured for.

    ``widths``, mapping of percentile to float, mm: thickness of the printed solid, once it is
    known.
    """
    if stated is None:
        return ()
    words, process = [], stated.process
    name = f"process {process.name}"
    if not process.has_body:
        words.append(
            f"{name}: its source gives neither offset, waviness nor stiffness, so that there is no "
            f"as-built body and nothing is said of it"
        )
    if material is not None and process.material and process.material != material.name:
        words.append(
            f"{name} was measured on {process.material}, the material of the case is "
            f"{material.name}"
        )
    if widths is not None and process.least_feature is not None:
        thin = widths["5"]
        if thin < process.least_feature:
            words.append(
                f"{name} prints features of {process.least_feature:.3g} mm or more: 5 % of the "
                f"surface has less than {thin:.3g} mm of solid behind it"
            )
    if widths is not None and process.sizes is not None and process.has_body:
        (least, most), usual = process.sizes, widths["50"]
        if not least <= usual <= most:
            words.append(
                f"{name} was measured on widths of {least:.3g} to {most:.3g} mm: half of the "
                f"surface has {'less' if usual < least else 'more'} than {usual:.3g} mm of solid "
                f"behind it, where its offsets are an extrapolation"
            )
    return tuple(words)


def as_built_data(
    stated: StatedProcess | None, body: AsBuiltBody | None, density: float | None
) -> dict[str, Any]:
    """Plain data on a process and the body that it builds; empty without a process.

    ``density``, t/mm^3.
    """
    if stated is None:
        return {}
    process = stated.process
    data: dict[str, Any] = {
        "process": process.name,
        "source": process.source,
        "material": process.material,
        "machine": process.machine,
        "samples": process.samples,
        "sizes_mm": None if process.sizes is None else list(process.sizes),
        "stiffness": process.stiffness,
        "stiffness_along": process.stiffness_along,
        "shear_along": process.shear_along,
        "strut_size_mm": {f"{a:g}": process.strut_size_at(a) for a in (0.0, 45.0, 90.0)}
        if process.strut_size or process.offset
        else {},
    }
    if body is None:
        return data
    area = np.linalg.norm(area_vectors(body.designed), axis=1)
    volume, built = enclosed_volume(body.designed), enclosed_volume(body.surface)
    return data | {
        "up": body.building.up.tolist(),
        "seed": stated.seed,
        "held_share": float(area[body.building.held].sum() / area.sum()),
        "nominal_mm3": volume,
        "as_built_mm3": built,
        "nominal_g": None if density is None else 1e6 * density * volume,
        "as_built_g": None if density is None else 1e6 * density * built,
        "compensated": None
        if body.compensated is None
        else {
            "file_mm3": enclosed_volume(body.file),
            "rms_mm": body.compensated.rms_mm,
            "most_mm": body.compensated.most_mm,
        },
    }
