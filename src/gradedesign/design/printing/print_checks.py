"""Limits of ``[print]`` beside the printed solid: rows of the verdict, warnings, plain data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from gradedesign.common.values.locate import Where, locating
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.printing.printability import (
    MOST_VOXELS,
    Printability,
    grid_step,
    measure_printability,
)
from gradedesign.design.printing.voids import BYTES_PER_VOXEL
from gradedesign.design.printing.wall_thickness import WallThickness
from gradedesign.errors import ResourceError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow

#: Share of the memory that the voxels of the checks may take. Chosen, not measured.
_MEMORY_SHARE = 0.5
#: Percentiles that limits are set on, %.
_THIN, _NARROW = "5", "5"
#: What leaves no rim where the part's faces cut walls: nothing, a solid layer below the faces, or
#: walls that meet them elsewhere.
_NO_FEATHERS = "a skin or [[keep]] below that face, another [lattice] origin or larger cells"
#: Changes of the case that help where a limit of ``[print.limits]`` is broken.
_HELPS = {
    "thickness": "[print] min_wall, larger cells or a higher lower density",
    "pore_throat": "larger cells or a lower upper density",
    "overhang": "another [print] build_direction or another cell",
    "support_volume": "another [print] build_direction or another cell",
    "islands": "another [print] build_direction or a skin",
    "trapped_powder": "[lattice] drain, no skin, or a cell with an open void",
    "feather_edges": _NO_FEATHERS,
}


def require_voxels_fit(
    spec: PrintSpec | None, part: SurfaceMesh, memory: int, where: Where
) -> None:
    """Refuse throats that no grid resolves within the memory, bytes, before anything is made.

    Raises ResourceError with what it takes.
    """
    if spec is None:
        return
    extent = np.ptp(part.vertices, axis=0)
    step, _, need = grid_step(spec, extent)
    most = min(_MEMORY_SHARE * memory, MOST_VOXELS * BYTES_PER_VOXEL)
    if need <= most:
        return
    key = "min_throat" if spec.min_throat is not None else "limits.pore_throat"
    with locating(where, f"print.{key}"):
        raise ResourceError(
            f"a grid of {step:.3g} mm, an eighth of the throat, on a part of "
            f"{' x '.join(f'{e:.4g}' for e in extent)} mm takes {need / 1e9:.3g} GB; found half of "
            f"[run] memory, {most / 1e9:.3g} GB; raise it, or state a wider throat"
        )


def check_printed(
    spec: PrintSpec | None, part: SurfaceMesh, surface: SurfaceMesh, thickness: WallThickness
) -> Printability | None:
    """Measure the printed solid where the case has ``[print]``; else None."""
    if spec is None:
        return None
    return measure_printability(surface, part, spec, thickness)


def print_rows(spec: PrintSpec | None, printability: Printability | None) -> tuple[LimitRow, ...]:
    """Every limit of ``[print.limits]`` beside its value; of throats where there are voids."""
    if printability is None or spec is None:
        return ()
    voids, hanging, limits = printability.voids, printability.overhang, spec.limits
    feathers = printability.feathers
    angle = f"surface inclined to the plate by less than {hanging.angle:g} deg, but on it"
    grid = f"the printed solid in voxels of {voids.step_mm:.3g} mm"
    rays = "rays through the printed solid"
    facets = "triangles of the printed solid"
    throat = voids.pore_throat_percentiles_mm.get(_NARROW, float("inf"))
    way = "no way out" if voids.min_throat_mm is None else f"{voids.min_throat_mm:g} mm throats"
    stated = (
        (
            "thickness",
            printability.thickness.percentiles_mm[_THIN],
            "mm",
            rays,
            f"{_THIN} % are thinner",
        ),
        ("pore_throat", throat, "mm", grid, "ball that reaches 95 % of the voids from outside"),
        ("overhang", hanging.supported_share, "", facets, f"share of {angle}"),
        ("support_volume", hanging.support_volume, "mm^3", facets, f"below {angle}"),
        (
            "islands",
            float(printability.islands.count),
            "",
            grid,
            "layers with nothing within a pixel",
        ),
        ("trapped_powder", voids.trapped_volume_mm3, "mm^3", grid, f"voids with {way}"),
        (
            "feather_edges",
            float("nan") if feathers is None else feathers.share,
            "",
            rays,
            "share of the surface with less than min_wall behind it at edges of less than 30 deg",
        ),
    )
    return tuple(
        LimitRow(
            key=LimitKey(kind="print", region=name),
            name=f"print {name.replace('_', ' ')}",
            load_case="",
            value=value,
            limit=float(getattr(limits, name)),
            unit=unit,
            judged_by=judge,
            unfavourable="low" if name in ("thickness", "pore_throat") else "high",
            measure=measure,
        )
        for name, value, unit, judge, measure in stated
        if getattr(limits, name) is not None and np.isfinite(value)
    )


def broken_words(rows: Sequence[LimitRow], *, helps: bool) -> str:
    """The limits of ``[print.limits]`` that do not hold, and what helps; empty where all do."""
    return "; ".join(
        f"{row.name} is {row.value:.4g} {row.unit}".rstrip()
        + f" instead of {'at least' if row.unfavourable == 'low' else 'at most'} "
        + f"{row.limit:.4g} {row.unit}".rstrip()
        + (f" ({_HELPS[row.key.region]} would help)" if helps else "")
        for row in rows
        if not row.passed
    )


def print_warnings(spec: PrintSpec | None, printability: Printability | None) -> tuple[str, ...]:
    """Warnings on the printed solid that no limit of the case covers."""
    if printability is None or spec is None:
        return ()
    return tuple(
        words
        for words in (
            _thin(spec, printability),
            _feathers(spec, printability),
            _powder(spec, printability),
            _islands(spec, printability),
            _support(spec, printability),
        )
        if words
    )


def _thin(spec: PrintSpec, printability: Printability) -> str:
    thin = printability.thickness.percentiles_mm[_THIN]
    if spec.min_wall is None or spec.limits.thickness is not None or thin >= spec.min_wall:
        return ""
    return (
        f"{_THIN} % of the printed surface has less than {thin:.3g} mm of solid behind it, [print] "
        f"min_wall is {spec.min_wall:g} mm; acute rims count, [print.limits] thickness enforces it"
    )


def _feathers(spec: PrintSpec, printability: Printability) -> str:
    found = printability.feathers
    if found is None or found.at_mm is None or spec.limits.feather_edges is not None:
        return ""
    return (
        f"feather edges: {found.share:.2g} of the printed surface, {found.area_mm2:.3g} mm^2, has "
        f"less than the min_wall of {found.wall_mm:g} mm behind it where two faces enclose less "
        f"than {found.angle_deg:g} deg, most of it about {_point(found.at_mm)}: such rims print "
        f"ragged or not at all; {_NO_FEATHERS} would help"
    )


def _powder(spec: PrintSpec, printability: Printability) -> str:
    voids = printability.voids
    if spec.limits.trapped_powder is not None or not voids.trapped_volume_mm3:
        return ""
    where = ""
    if voids.trapped:
        worst = voids.trapped[0]
        way = f"throats of {worst.way_mm:.3g} mm at {_point(worst.throat_mm)}"
        where = f"; the largest holds {worst.volume_mm3:.4g} mm^3 at {_point(worst.at_mm)}, " + (
            way if worst.throat_mm else "without a way out"
        )
    return (
        f"powder of {voids.trapped_volume_mm3:.4g} mm^3 cannot leave: {voids.closed} closed voids "
        + (
            ""
            if voids.min_throat_mm is None
            else f"and those behind throats of less than {voids.min_throat_mm:g} mm"
        )
        + where
    )


def _islands(spec: PrintSpec, printability: Printability) -> str:
    islands = printability.islands
    if spec.limits.islands is not None or islands.worst is None:
        return ""
    worst = islands.worst
    return (
        f"{islands.count} islands begin in layers without anything below them; the largest at "
        f"{_point(worst.at_mm)}, {worst.volume_mm3:.3g} mm^3 over {worst.height_mm:.3g} mm until "
        f"it is joined"
    )


def _support(spec: PrintSpec, printability: Printability) -> str:
    hanging = printability.overhang
    if spec.limits.overhang is not None or spec.limits.support_volume is not None:
        return ""
    if not hanging.supported_area:
        return ""
    return (
        f"{hanging.supported_share:.1%} of the printed surface overhangs at less than "
        f"{hanging.angle:g} deg, above {hanging.support_volume:.4g} mm^3 of support; with what "
        f"lies on the plate {hanging.fraction:.1%}, and {hanging.least:.1%} if it were built "
        f"towards {_point(hanging.best, '')}"
    )


def _point(place: tuple[float, float, float] | None, unit: str = " mm") -> str:
    return f"({', '.join(f'{c:.4g}' for c in place or ())}){unit}"


def print_data(printability: Printability | None) -> dict[str, Any]:
    """Plain data for ``measures`` of result.json; empty where nothing was measured."""
    if printability is None:
        return {}
    hanging = printability.overhang
    return {
        "printability": {
            "build_direction": printability.build_direction,
            "thickness_percentiles_mm": dict(printability.thickness.percentiles_mm),
            "overhang": {
                "angle_deg": hanging.angle,
                "share_by_angle_deg": dict(hanging.share_by_angle),
                "fraction": hanging.fraction,
                "least_fraction": hanging.least,
                "least_direction": list(hanging.best),
                "most_fraction": hanging.most,
                "most_direction": list(hanging.worst),
                "supported_share": hanging.supported_share,
                "supported_area_mm2": hanging.supported_area,
                "support_volume_mm3": hanging.support_volume,
            },
            "islands": asdict(printability.islands),
            "voids": asdict(printability.voids),
            "feather_edges": (
                None if printability.feathers is None else asdict(printability.feathers)
            ),
        }
    }
