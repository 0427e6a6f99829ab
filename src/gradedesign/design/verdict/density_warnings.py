"""Where what is printed misses the density that a case states: by how much, why, and what helps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.resolve.lattice_files import chord_tolerance
from gradedesign.design.resolve.stated_lattice import StatedLattice
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.printed_surface import STEPS_PER_WALL, VOLUME_ERROR, first_step
from gradedesign.geometry.lattice.slab_density import FIELD_ERROR, SlabDensities, total

#: Share of a miss from which on its cause is told. Chosen, not measured.
_TOLD = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class BesideCells:
    """Volumes that no density states, over that of the part."""

    loose: float  #: Of disconnected components that were left out.
    joints: float  #: That joints and net-skins add.


def density_warnings(
    stated: StatedLattice, slabs: Sequence[SlabDensities], beside: BesideCells
) -> tuple[str, ...]:
    """A warning where the printed density of the whole part is off the stated one.

    Off by more than `VOLUME_ERROR` and what the sampled means of slabs across the three axes, which
    are means over the same part, differ by.

    ``slabs``: across x, y and z.
    """
    case, cells, domain, wall = stated.case, stated.cells, stated.design.domain, stated.wall
    targets = [total(one, "target") for one in slabs]
    target, field = float(np.mean(targets)), float(np.mean([total(s, "field") for s in slabs]))
    printed = total(slabs[0], "surface")
    missed = printed - target
    if abs(missed) <= VOLUME_ERROR * target + np.ptp(targets):
        return ()
    causes = _causes(
        case.lattice.cell_size, case.print, slabs[0], wall, beside, (target, field, printed)
    )
    share = {name: value / missed for name, value in causes.items()}
    told = sorted((name for name in share if share[name] > _TOLD), key=lambda name: -share[name])
    because = {
        "cells": _of_cells(cells, domain),
        "joints": "joints and net-skins add to it (a lower density makes up for that)",
        "loose": (
            "disconnected components of the lattice were left out (a higher density, or a skin "
            "that holds them, keeps them)"
        ),
        "contour": _of_contour(case.print, slabs[0].measured_on, wall),
    }
    why = ", ".join(f"{causes[name] / target:+.1%} since {because[name]}" for name in told)
    key = "lattice.density_map" if case.lattice.density_map is not None else "lattice.density"
    return (
        f"{case.where(key)}: the printed density of the whole part is {printed:.4f} where "
        f"{target:.4f} is stated{', with what stays solid' if domain.solids else ''}, "
        f"{missed / target:+.1%} off and more than {VOLUME_ERROR:.0%}: {why}",
    )


def _causes(
    cell_size: float,
    printer: PrintSpec | None,
    slabs: SlabDensities,
    wall: float,
    beside: BesideCells,
    means: tuple[float, float, float],
) -> dict[str, float]:
    """Contribution of each cause; ``means`` are target, field and printed density."""
    target, field, printed = means
    of_cells, of_contour = field - target - beside.joints, printed - field + beside.loose
    if abs(of_cells) <= FIELD_ERROR:
        # The points do not tell the two apart; walls that the grid can draw are drawn.
        both = of_cells + of_contour
        of_cells, of_contour = (
            (0.0, both) if _coarse(cell_size, printer, slabs, wall) else (both, 0.0)
        )
    return {
        "cells": of_cells,
        "joints": beside.joints,
        "loose": -beside.loose,
        "contour": of_contour,
    }


def _coarse(cell_size: float, printer: PrintSpec | None, slabs: SlabDensities, wall: float) -> bool:
    """Whether walls are too thin for the layers, the stated triangles or the finest first grid."""
    finest = first_step(cell_size, 0.0)
    return (
        slabs.measured_on == "layers"
        or chord_tolerance(printer) is not None
        or wall < STEPS_PER_WALL * finest
    )


def _of_cells(cells: Cells, domain: DesignDomain) -> str:
    """Why the field holds more or less than the cells do on average, and what helps."""
    period = cells.period
    if period > 1:
        return (
            f"the cells are random and repeat after {period} of them, and a part of few of them "
            f"holds more or less than their mean (smaller cells come closer)"
        )
    if domain.solids or domain.cuts:
        return (
            "solid regions, skins and drains lie where the cells have more, or less, solid than "
            "on average, such as along their struts, and nothing makes up for it in what is left "
            "of the cells (another [lattice] origin, smaller cells or another stated density "
            "comes closer)"
        )
    return (
        "faces of the part cut cells where they have more, or less, solid than on average, or the "
        "density changes much within a cell (another [lattice] origin, whole cells across the "
        "part, smaller cells or another stated density comes closer)"
    )


def _of_contour(printer: PrintSpec | None, measured_on: str, wall: float) -> str:
    """Why the surface, or the layers, hold more or less than the field, and what helps."""
    if measured_on == "layers":
        return (
            f"layers and pixels are too coarse for walls of {wall:.3g} mm (a smaller [print] "
            f"pixel_size or layer_height, larger cells or a higher density comes closer)"
        )
    if chord := chord_tolerance(printer):
        return (
            f"triangles were merged within [print] chord_tolerance, {chord:g} mm, on walls of "
            f"{wall:.3g} mm (a smaller one comes closer)"
        )
    return (
        f"walls of {wall:.3g} mm lie between the nodes of the grid on which the surface is drawn "
        f"and are lost in places (a higher density comes closer)"
    )
