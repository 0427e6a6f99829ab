"""The contour of a lattice, a little beyond its part, and the grid that holds its volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.geometry.contour.resolution import CoarseContourError, Resolution
from gradedesign.geometry.contour.surface import Contour, boxed_grid, contour
from gradedesign.geometry.contour.true_volume import VolumeFit
from gradedesign.geometry.lattice.cube_sides import cube_sides, room_in_part, where_wanted
from gradedesign.geometry.lattice.domain import grown
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field, uncut_field
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: The lattice is contoured this many grid steps beyond the part before it is cut. Chosen, not
#: measured.
OVERHANG = 2.0
#: Cells of a contour that was too coarse in which finer ones are tried, each of these steps over
#: the one before, down to a least one. A contour of all cells takes 1.4 to 1.6 times as long at
#: each; of `knot` it took six before, 7 min. Chosen, not measured.
_WORST, _FINER, _LEAST = 8, 0.85, 0.25
#: Share of the allowed error that does there, as other cells may be worse at another step. Chosen,
#: not measured.
_ENOUGH = 0.95
#: Nodes of a grid are a rounding error off, in its steps.
_ROUNDING = 1e-6

Box = tuple[FloatArray, FloatArray]


def lattice_contour(
    design: LatticeDesign,
    part: SurfaceMesh,
    step: float,
    asked: Resolution | None,
    *,
    keep_outer: bool = False,
) -> tuple[Contour, Field]:
    """Contour of a lattice that goes beyond its part by the overhang, and the field of it.

    Raises CoarseContourError if the volume of a cell is off by more than is asked for.

    ``keep_outer``: all of the contour, which lies behind a skin, rather than the cubes that the
    part cuts.
    """
    fit = volume_fit(design, step, asked)
    with stepping(f"contouring at {step:.3g} mm"):
        raw, field = _contour_in(design, part, step, fit, keep_outer)
    error = float(raw.volume_errors.max(initial=0.0))
    if asked is not None and error > asked.within:
        raise CoarseContourError(
            f"at a grid of {step:.3g} mm the surface of a cell is estimated to hold {error:.1%} "
            f"more or less than its solid, expected at most {asked.within:.1%}",
            step=step,
            error=error,
            worst=fit.worst_cells(raw.volume_errors, _WORST),
        )
    return raw, field


def finer_step(
    design: LatticeDesign,
    part: SurfaceMesh,
    missed: CoarseContourError,
    asked: Resolution,
    *,
    keep_outer: bool = False,
) -> float:
    """Step that should do after a contour that was too coarse, mm.

    Ever finer ones are tried in its worst cells, where there are others: no power of the step holds
    where struts meet in edges.
    """

    def error_in(box: Box, step: float) -> float:
        fit = volume_fit(design, step, asked, box)
        raw, _ = _contour_in(design, part, step, fit, keep_outer)
        return float(raw.volume_errors.max(initial=0.0))

    step, does = _FINER * missed.step, _ENOUGH * asked.within
    while len(missed.worst) == _WORST and step > _LEAST * missed.step:
        with stepping(f"the {_WORST} worst cells at {step:.3g} mm"):
            # The worst comes first: a step that does not do ends there.
            if all(error_in(box, step) <= does for box in missed.worst):
                break
        step *= _FINER
    return step


def _contour_in(
    design: LatticeDesign, part: SurfaceMesh, step: float, fit: VolumeFit, keep_outer: bool
) -> tuple[Contour, Field]:
    """Contour in the box of a fit and the overhang beyond it, and its field.

    On nodes of the grid of the whole part: what a cell is off by depends on where they lie in it.
    """
    beyond = (OVERHANG + 1.0) * step
    first = design.domain.lower - beyond
    nodes = np.floor((fit.lower - beyond - first) / step + _ROUNDING)
    grid = boxed_grid(first + step * nodes, fit.upper + beyond, step)
    design = replace(design, domain=grown(design.domain, OVERHANG * step))
    if keep_outer:
        field = lattice_field(design, band=3 * step, single=True)
        return contour(field, grid, fit=fit), field
    field = uncut_field(design, band=3 * step, single=True)
    sides = cube_sides(part, grid.origin, grid.shape, step)
    fit = replace(fit, room=room_in_part(sides, grid, fit))
    wanted = where_wanted(field, sides, grid.origin, step)
    return contour(wanted, grid, sides=sides, fit=fit), field


def volume_fit(
    design: LatticeDesign, step: float, asked: Resolution | None, box: Box | None = None
) -> VolumeFit:
    """How vertices of a lattice are placed by volume; vertices on solid layers stay there.

    ``step`` is the grid, mm, of a contour that goes beyond the part by the overhang. ``box``: in
    which volumes count; that of the part by default.
    """
    part, layers = solid_layers(grown(design.domain, OVERHANG * step), 3 * step)

    def solids(points: FloatArray) -> FloatArray:
        distance = part(points)
        return np.asarray(np.minimum.reduce([layer(points, distance) for layer in layers]))

    domain = design.domain
    lower, upper = box or (domain.lower, domain.upper)
    return VolumeFit(
        lower=lower,
        upper=upper,
        # Without cells it is the volume of the body that counts, not that of slivers of members.
        cell=design.cell_size if domain.has_cells else float((domain.upper - domain.lower).max()),
        solids=solids if layers else None,
        memory=np.inf if asked is None else asked.memory,
    )
