"""Checks that a part has room for the cells, skins, solid regions and grids of its case."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.placed_map import REPORT_POINTS
from gradedesign.geometry.maps.cell_map import turned_axes
from gradedesign.geometry.maps.map_report import volume_points
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.raw_triangles import UNIT_MM

#: Longest edge of a part, mm, outside which its unit is questioned: a part of 250 mm whose inches
#: are read as mm is 10 mm long, one of 10 mm whose mm are read as m 10 m. Chosen, not measured.
_USUAL_EDGE = (10.0, 1e4)
#: A part of exactly one cell may come out a rounding error shorter.
_ROUNDING = 1e-6
#: Bytes for each node of the density grid, with what its smoothing holds at a time.
_BYTES_PER_NODE = 64.0
#: Cells along a part, from its thinnest bar to the finest foam that is designed: where another unit
#: of the part is offered. Chosen, not measured.
_USUAL_CELLS = (2.0, 300.0)
#: Nodes of the density grid along a cell. Chosen, not measured.
_NODES_PER_CELL = 4


def size_warnings(
    lattice: LatticeSpec, stated: PartSpec, where: Where, part: Part
) -> tuple[str, ...]:
    """Warnings for a part whose unit may be wrong, and for cells longer than it is wide."""
    edges = np.ptp(part.surface.vertices, axis=0)
    low, high = _USUAL_EDGE
    remarks = []
    if not low <= edges.max() <= high:
        size = " x ".join(f"{edge:.4g}" for edge in edges)
        key = "part.units" if stated.units else "part"
        others = _other_units(lattice, stated, float(edges.max()))
        remarks.append(
            f"{where(key)}: the part is {size} mm; is its unit right"
            + (f" ({others} long)?" if others else "?")
        )
    if len(lattice.size) == 3 and lattice.cell_map is None:
        along = np.ptp(turned_axes(lattice.rotation).T @ part.surface.vertices.T, axis=1)
        remarks += [
            f"{where('lattice.size')}: cells are {cell:g} mm long along their {axis} axis, "
            f"along which the part is {edge:.4g} mm: less than one cell; is its unit right?"
            for axis, cell, edge in zip("xyz", lattice.edges, along, strict=True)
            if cell > edge * (1 + _ROUNDING)
        ]
    return tuple(remarks)


def inner_points(domain: DesignDomain) -> FloatArray:
    """Points that fill the whole part evenly, ``(3, n)``, mm."""
    return volume_points(domain.distance, domain.lower, domain.upper, REPORT_POINTS)


def require_cells_fit(
    lattice: LatticeSpec, stated: PartSpec, memory: float, where: Where, part: Part
) -> None:
    """Refuse cells longer than the whole part, or too many for a grid of densities.

    The unit of the part is asked for where another one makes its cells fit.

    Raises CaseError or ResourceError, naming file, line, what was found and what would fit.
    """
    edges = np.ptp(part.surface.vertices, axis=0)
    cell, longest = lattice.cell_size, float(edges.max())
    if not lattice.cells:
        if cell > edges.min() * (1 + _ROUNDING):
            raise CaseError(
                f"{where('lattice.least_member')}: found {cell:g} mm in a part of "
                f"{' x '.join(f'{edge:.4g}' for edge in edges)} mm; expected no more than its "
                f"shortest edge, {edges.min():.4g} mm: members as thick leave no choice"
            )
        return
    size, other = where("lattice.size"), _or_that_of_the_part(lattice, stated, longest)
    if max(lattice.size) > longest * (1 + _ROUNDING):
        raise CaseError(
            f"{size}: found cells of {lattice.size_words} in a part of "
            f"{' x '.join(f'{edge:.4g}' for edge in edges)} mm; expected a cell shorter than the "
            f"part, {longest:.4g} mm at most; is its unit right"
            f"{other}?"
        )
    need = _BYTES_PER_NODE * float(np.prod(edges / cell * _NODES_PER_CELL + 5.0))
    if need > memory:
        raise ResourceError(
            f"{size}: found cells of {lattice.size_words}, about "
            f"{part.volume / cell**3:.2g} in the part; a grid that resolves their densities takes "
            f"{need / 1e9:.2g} GB, expected at most the {memory / 1e9:.2g} GB of [run] "
            f"memory; take larger cells; is their unit right"
            f"{other}?"
        )


def _or_that_of_the_part(lattice: LatticeSpec, stated: PartSpec, longest: float) -> str:
    """Words on the unit of the part's file where the part has some cells in another one."""
    others = _other_units(lattice, stated, longest)
    if not others:
        return ""
    return (
        f', or [part] units = "{stated.units}", in which the part is {longest:.4g} mm long '
        f"({others})"
    )


def _other_units(lattice: LatticeSpec, stated: PartSpec, longest: float) -> str:
    """Units of the part's file in which it has some cells, with its lengths; empty where none."""
    units = stated.units
    if stated.file is None or units is None:
        return ""
    # One name for each size: the first one.
    named = {size: unit for unit, size in reversed(UNIT_MM.items()) if size != UNIT_MM[units]}
    lengths = {unit: longest * size / UNIT_MM[units] for size, unit in named.items()}
    low, high = (count * max(lattice.size) for count in _USUAL_CELLS)
    fitting = [f'"{unit}" {long:.4g}' for unit, long in lengths.items() if low <= long <= high]
    return f"in {', in '.join(fitting)} mm" if fitting else ""


def require_warps_reach(lattice: LatticeSpec, where: Where, points: FloatArray) -> None:
    """Refuse warps in whose sphere no lattice lies: they would change nothing.

    Raises CaseError, naming file, line and the nearest place of the lattice.

    ``points``, (3, n) array, mm: that fill the lattice evenly.
    """
    for number, warp in enumerate(lattice.warp):
        away = np.linalg.norm(points - np.array(warp.centre)[:, None], axis=0)
        nearest = int(np.argmin(away))
        if away[nearest] > warp.outer_radius:
            raise CaseError(
                f"{where(f'lattice.warp[{number}].centre')}: found "
                f"({', '.join(f'{c:g}' for c in warp.centre)}) mm, but the lattice comes no nearer "
                f"than {away[nearest]:.4g} mm, at "
                f"({', '.join(f'{c:.4g}' for c in points[:, nearest])}) mm, and outer_radius is "
                f"{warp.outer_radius:g} mm: nothing would change; expected a centre in the part "
                f"or a larger radius"
            )


def require_lattice_left(where: Where, points: FloatArray, domain: DesignDomain) -> None:
    """Refuse a skin and solid regions that leave no place for a lattice.

    Raises CaseError, naming the key that fills the part.

    ``points``, (3, n) array, mm: where the part is lattice.
    """
    if points.shape[1]:
        return
    inside = inner_points(domain)
    if not inside.shape[1]:
        raise CaseError(
            f"{where('part')}: no place was found inside the part: it is far thinner than its "
            f"bounding box is long"
        )
    to_part = np.asarray(domain.distance(inside))
    for solid in (ordered := sorted(domain.solids, key=lambda solid: -solid.phase)):
        if why := solid.why_full(inside, to_part):
            raise CaseError(why)
    raise CaseError(
        f"{ordered[0].where}: skin and solid regions together fill the whole part, so no lattice "
        f"is left; expected thinner ones"
    )
