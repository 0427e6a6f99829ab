"""The least density whose walls can be resolved and judged within the budgets of a case.

A density window may begin where walls are a fiftieth of a cell: a part of some hundred cells with
such walls has more unknowns than any budget holds, so sizing would end in a design that nobody can
judge. The lower bound is raised to where the finer of the two resolutions of acceptance fits the
memory and its share of the stated time, and the result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.acceptance.whole_resolution import first_spacing
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.resolve.least_density import SAMPLES, Need, Needs, need_of
from gradedesign.design.resolve.planned_solid import PlannedPart, planned_solid
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cell_surface import CellSurface, cell_surface
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis

#: Mean density that a sized lattice is expected to have: this share of its window above the lower
#: bound. Spacings grow with the third root of a volume: a guess 50 % off moves them by 14 %.
EXPECTED_SHARE = 1 / 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysable:
    """Density bounds whose lattice the budgets hold."""

    analysis: ExplicitAnalysis
    bounds: tuple[float, float]
    elements_per_wall: float  #: Elements across the thinnest wall.
    spacing: float  #: mm. Element size that the walls at the lower bound ask for.
    #: Expected of the explicit analysis; where it is refused, the least of the window.
    memory_bytes: int
    warnings: tuple[str, ...] = ()
    refusal: str = ""  #: Why no density of the window fits the budget; empty where one does.
    #: The same of every zone of the case; empty where it has none.
    zones: tuple[Analysable, ...] = ()


def grid_spacing(
    domain: DesignDomain,
    wall: FloatArray | float,
    elements_per_wall: float,
    analysis: ExplicitAnalysis,
) -> FloatArray:
    """Element size for walls ``(...)`` mm beside the solid layers of a part, ``(...)`` mm."""
    layers = min(domain.layers, default=np.inf)
    return np.minimum(np.asarray(wall) / elements_per_wall, layers / analysis.elements_per_layer)


def analysable_bounds(
    lattice: LatticeSpec,
    run: RunSpec,
    cell: Cell,
    bounds: tuple[float, float],
    least_size: float,
    analysis: ExplicitAnalysis,
    *,
    part: PlannedPart,
    domain: DesignDomain,
) -> Analysable:
    """Raise the lower density bound to the least that the budgets can analyse and accept.

    ``bounds``: density window of user, cell, law and printer. ``least_size``, mm: shortest extent
    of any cell. ``part``: with the volumes of its lattice and of what stays solid. Returns
    Analysable: with the bounds as they were where the case asks for no explicit analysis, states
    its grid, or states the thickness of its walls, and where nothing fits. Where no density lets
    the finer resolution of acceptance fit, the iterations alone decide.
    """
    low, high = bounds
    rho = np.geomspace(low, high, SAMPLES)
    stated = lattice.wall
    walls = np.full(SAMPLES, stated) if stated else _walls(cell, rho, least_size)
    mean = rho if lattice.grading == "uniform" else rho + EXPECTED_SHARE * (high - rho)
    surfaces = cell_surface(cell, mean, least_size)
    planned = [
        planned_solid(part, *of_lattice)
        for of_lattice in zip(mean, map(CellSurface, *surfaces), strict=True)
    ]

    per_wall = run.elements_per_wall or analysis.elements_per_wall(cell)
    spacings = grid_spacing(domain, walls, per_wall, analysis)
    if run.explicit_mesh_size:
        spacings = np.full(SAMPLES, run.explicit_mesh_size)
    first = first_spacing(analysis, 1.0, cell)
    needs = [
        need_of(analysis, to_build, float(spacing), first)
        for to_build, spacing in zip(planned, spacings, strict=True)
    ]
    seen = Needs(spacings=spacings, needs=needs, memory=run.memory, time=run.time)
    least, refusal, fits = 0, "", seen.fits
    unbound = stated or run.explicit_mesh_size or run.stop_after != "verdict"
    if not (unbound or fits.any()):
        layer = min(domain.layers, default=np.inf)
        refusal = _refusal(max(lattice.size), walls, seen, layer, analysis, max(part.box))
    elif not unbound:
        least = int(np.argmax(fits))
    warnings = _raised(run, (low, rho[least]), walls[least], needs[0]) if least else ()
    return Analysable(
        analysis=analysis,
        bounds=(float(rho[least]) if least else low, high),
        elements_per_wall=per_wall,
        spacing=float(spacings[least]),
        memory_bytes=int(seen.bytes.min() if refusal else seen.bytes[least]),
        warnings=warnings,
        refusal=refusal,
    )


def analysable_together(zones: Sequence[Analysable]) -> Analysable:
    """Bounds of all zones of a part for one analysis, whose grid the thinnest walls set."""
    if len(zones) == 1:
        return zones[0]
    return replace(
        zones[0],
        bounds=(min(z.bounds[0] for z in zones), max(z.bounds[1] for z in zones)),
        spacing=min(z.spacing for z in zones),
        memory_bytes=max(z.memory_bytes for z in zones),
        warnings=tuple(dict.fromkeys(w for z in zones for w in z.warnings)),
        refusal=next((z.refusal for z in zones if z.refusal), ""),
        zones=tuple(zones),
    )


def _raised(run: RunSpec, bounds: tuple[float, float], wall: float, need: Need) -> tuple[str, ...]:
    """Sentence on a lower density that was raised, and on the cost without that."""
    low, raised = bounds
    return (
        f"lower density raised from {low:.3g} to {raised:.3g}: walls thinner than {wall:.3g} mm "
        f"need finer grids than [run] memory {run.memory / 1e9:.3g} GB and time "
        f"{run.time / 60:.3g} min hold (at density {low:.3g} {need.words()}); more of both or "
        f"larger cells let it fall",
    )


def _walls(cell: Cell, rho: FloatArray, least_size: float) -> FloatArray:
    walls = wall_mm(cell, rho, least_size)
    # At the percolation floor a strut has no thickness: no grid resolves it.
    return np.maximum(walls, 1e-3 * least_size)


def _refusal(
    cell_size: float,
    walls: FloatArray,
    seen: Needs,
    layers: float,
    analysis: ExplicitAnalysis,
    longest: float,
) -> str:
    """Sentence on the grid that does not fit the memory, and on a remedy."""
    spacings, need = seen.spacings, seen.bytes
    best = int(np.argmin(need))
    larger = (need[best] / seen.memory) ** (1 / 3)
    governed = spacings[best] >= layers / analysis.elements_per_layer * (1 - 1e-9)
    cause = (
        f"solid layers of {layers:.3g} mm ask for a grid of {spacings[best]:.3g} mm"
        if governed
        else f"walls of {walls[best]:.3g} mm ask for a grid of {spacings[best]:.3g} mm"
    )
    size, what = (layers, "these layers") if governed else (cell_size, "the cells")
    # Nothing grows beyond the part.
    remedy = f", or make {what} {larger:.2f} times as large" if larger * size <= longest else ""
    return (
        f"the explicit analysis does not fit [run] memory {seen.memory / 1e9:.3g} GB: {cause}, "
        f"which takes {need[best] / 1e9:.3g} GB at least; allow more memory{remedy}"
    )
