"""Values that fill a part, on a regular grid, as the page colours faces and cuts by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.components.zone import Zones
from gradedesign.geometry.lattice.domain import DesignDomain, phase_at
from gradedesign.mechanics.explicit.measures import PHASES
from gradedesign.program.pictures.packed import packed
from gradedesign.program.pictures.region_mark import COLOURS

#: Points of a grid: 70 along the edge of a cube. Chosen, not measured.
_POINTS = 350_000
#: Levels of a scalar: what eight bits hold.
_LEVELS = 255
#: Colours of the cells of zones, a lighter and a darker one for neighbours.
_CELLS = (
    ("#cfd8e3", "#a9b8c9"), ("#e6d3b8", "#cdb088"), ("#c9e2d0", "#97c0a4"),
    ("#dccfe6", "#b79fc8"), ("#efd0cf", "#d59f9d"),
)  # fmt: skip
#: Phases of a part, and colours of those that are no lattice.
_PHASES = dict(enumerate(zip(PHASES, ("", "#8d6e63", COLOURS["passive"], "#37474f"), strict=True)))

_MEMBERS = PHASES.index("solid members")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Volume:
    """A regular grid around a part."""

    lower: FloatArray  #: ``(3,)``, mm. First node.
    step: float  #: mm.
    #: ``(nx, ny, nz)``. Nodes in the part, or within a step of it where it is thin.
    inside: BoolArray
    points: FloatArray  #: ``(3, n)``, mm. These nodes.


def volume_of(domain: DesignDomain) -> Volume:
    """A grid over the box of a part; the nodes just outside stand for walls thinner than a step."""
    size = domain.upper - domain.lower
    step = float((size.prod() / _POINTS) ** (1 / 3))
    shape = tuple(int(n) for n in np.ceil(size / step) + 1)
    points = grid_points(domain.lower, (0, 0, 0), (shape[0], shape[1], shape[2]), step)
    inside = domain.distance(points) < 0.5 * step
    return Volume(lower=domain.lower, step=step, inside=inside, points=points[:, inside])


def cells_data(
    volume: Volume, domain: DesignDomain, cell_map: Field | None, has_cells: bool
) -> dict[str, Any]:
    """Cells, their zones, and what stays solid.

    ``cell_map``: points ``(3, n)`` mm to cell coordinates of period 1; None where they are not
    known yet. ``has_cells``: whether cells are a phase; else what is not solid is void, or either
    before a run.
    """
    points = volume.points
    phase = phase_at(domain, points)
    rest = "lattice" if has_cells else "void" if (phase == _MEMBERS).any() else "solid or void"
    zones = next(((rest, *each.names[1:]) for each in domain.of(Zones)), (rest,))
    zone = np.zeros(points.shape[1], dtype=np.int64)
    for each in domain.of(Zones):
        zone = np.argmax(each.weights(points), axis=0)
    odd = np.zeros_like(zone)
    if cell_map is not None:
        odd = np.floor(cell_map(points)).sum(axis=0).astype(np.int64) % 2
    label = np.where(phase > 0, phase, 4 + 2 * (zone % len(_CELLS)) + odd)
    palette = {number: colour for number, (_, colour) in _PHASES.items()}
    legend = [{"text": name, "colour": _CELLS[k % len(_CELLS)][0]} for k, name in enumerate(zones)]
    for number, (text, colour) in _PHASES.items():
        if number and (phase == number).any():
            legend.append({"text": text, "colour": colour})
    for k, (light, dark) in enumerate(_CELLS):
        palette |= {4 + 2 * k: light, 5 + 2 * k: dark}
    return {**_grid_data(volume, label), "palette": palette, "legend": legend}


def scalar_data(volume: Volume, values: FloatArray, low: float, high: float) -> dict[str, Any]:
    """Values ``(n,)`` at the points of a grid, in 256 levels from ``low`` to ``high``."""
    reach = high - low if high > low else 1.0
    levels = np.rint(_LEVELS * np.clip((values - low) / reach, 0.0, 1.0)).astype(np.int64)
    return {**_grid_data(volume, levels), "low": low, "high": high}


def _grid_data(volume: Volume, values: IntArray) -> dict[str, Any]:
    """The grid with its values; nodes outside take that of the nearest node inside."""
    grid = np.zeros(volume.inside.shape, dtype=np.uint8)
    grid[volume.inside] = values
    nearest = distance_transform_edt(~volume.inside, return_distances=False, return_indices=True)
    filled = grid[tuple(nearest)]
    return {
        "lower": volume.lower.tolist(),
        "step": volume.step,
        "shape": list(filled.shape),
        # x runs fastest, as textures have it.
        "values": packed(filled.transpose(2, 1, 0).ravel(), 8),
    }
