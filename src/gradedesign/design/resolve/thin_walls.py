"""Walls of a part that are too thin for its cells, or for the printer, in words."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.arrays import BoolArray
from gradedesign.common.values.locate import Where
from gradedesign.common.values.value_types import Triple
from gradedesign.design.printing.gaps import FacingPlaces, thin_walls
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.domain import LATTICE, DesignDomain, phase_at
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.thickness import local_thickness

#: Points in the lattice at which the part's thickness is measured. Chosen, not measured.
_SAMPLE_POINTS = 1500
#: A wall of exactly one cell, or of exactly the printer's thinnest wall, may come out a rounding
#: error thinner.
_ROUNDING = 1e-6
#: Share of the surface from which on walls thinner than a cell are told: less is the ligament
#: beside a bore (0.13 % in the shipped bracket), not a fin. Chosen, not measured.
_LITTLE = 0.002


def median_thickness(rotation: Triple, part: Part, layout: CellLayout) -> float:
    """Median thickness of the part over its lattice, along turned axes, mm; inf without one."""
    if not layout.points.size:
        return np.inf
    every = max(layout.points.shape[1] // _SAMPLE_POINTS, 1)
    axes = Rotation.from_euler("XYZ", rotation, degrees=True).as_matrix()
    lengths = local_thickness(part.surface, layout.points[:, ::every], axes)
    return float(np.median(lengths)) if lengths.size else np.inf


def thin_wall_warnings(
    printed: float,
    cell: float,
    rotation: Triple,
    part: Part,
    domain: DesignDomain,
    layout: CellLayout,
    where: Where,
) -> tuple[str, ...]:
    """Warnings on walls of the part thinner than the printer makes, or than a ``cell``, mm.

    A wall that stays solid may be thinner than a cell, as may some on little of the surface. A body
    without cells has one of 0.
    """
    walls = thin_walls(part.surface, max(printed, cell) * (1 - _ROUNDING))
    unprinted = walls.width < printed * (1 - _ROUNDING)
    warnings = []
    if unprinted.any():
        thinnest, share = _thinnest(walls, unprinted)
        warnings.append(
            f"{where('print.min_wall')}: walls of the part are down to {thinnest}, less than "
            f"the {printed:g} mm that the printer makes, on {share:.2%} of its surface: they "
            f"print ragged or not at all, solid or not; thicken them in the part or leave them out"
        )
    median = median_thickness(rotation, part, layout)
    if median < cell:
        warnings.append(
            f"{where('lattice.size')}: half of the lattice lies where the part is no thicker "
            f"than {median:.3g} mm, less than one cell of {cell:.3g} mm: cut walls and "
            f"struts are left of it there, which hold little; expected cells of at most "
            f"{median / 2:.3g} mm, two of them across, or a part that stays solid there ([[keep]])"
        )
        return tuple(warnings)
    cut = (walls.width < cell * (1 - _ROUNDING)) & ~unprinted
    cut[cut] = phase_at(domain, walls.middle[:, cut]) == LATTICE
    if np.count_nonzero(cut) >= _LITTLE * walls.rays:
        thinnest, share = _thinnest(walls, cut)
        across = float(walls.width[cut].min())
        warnings.append(
            f"{where('lattice.size')}: walls of the part that become lattice are down to "
            f"{thinnest}, less than one cell of {cell:.3g} mm, on {share:.2%} of its surface: no "
            f"whole cell fits in there, and what cut walls and struts hold depends on where its "
            f"faces cut them; [[keep]] holds such a wall solid, cells of at most {across / 2:.3g} "
            f"mm fit twice across it"
        )
    return tuple(warnings)


def _thinnest(walls: FacingPlaces, chosen: BoolArray) -> tuple[str, float]:
    """The thinnest of the chosen walls with its place, and their share of the surface."""
    k = int(np.argmin(np.where(chosen, walls.width, np.inf)))
    place = ", ".join(f"{value:.4g}" for value in walls.middle[:, k])
    share = float(np.count_nonzero(chosen)) / walls.rays
    return f"{walls.width[k]:.3g} mm thin at ({place}) mm", share
