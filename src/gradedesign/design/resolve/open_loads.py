"""Loads on open lattice: loaded regions below which no solid lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.suggest import shown
from gradedesign.geometry.lattice.domain import LATTICE, DesignDomain, phase_at
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec

#: Depth below a region at which solid is looked for, over the edge of a cell. Chosen, not measured.
DEPTH = 1e-3
#: Points of a region at which it is looked for, at least. Chosen, not measured.
SAMPLES = 1000
#: Thickness of the plate that is named over the edge of a cell: a third of the openings between
#: walls, which are about half an edge wide. By proportion, not measured.
PLATE = 1 / 6
#: Share of a region's area that may lie open: beside it the cut edges of skins and margins. Chosen,
#: not measured.
OPEN = 0.1


def _open_share(region: Region, domain: DesignDomain, depth: float) -> float:
    """Share of a region's area below which there is lattice.

    Parameters
    ----------
    depth : float, mm
        Below the surface at which solid is looked for.
    """
    a, b, c = np.moveaxis(region.corners, 1, 0)
    across = np.cross(b - a, c - a)
    twice = np.linalg.norm(across, axis=1)
    used = twice > 0
    inward = -across[used] / twice[used, None]
    shares = _places(int(np.ceil(np.sqrt(SAMPLES / used.sum()))))
    points = np.einsum("pc,tcd->dtp", shares, region.corners[used])
    points += depth * inward.T[:, :, None]
    open_ones = (phase_at(domain, points) == LATTICE).mean(axis=1)
    return float(twice[used] @ open_ones / twice.sum())


def _places(parts: int) -> FloatArray:
    """Centroids of the ``parts^2`` equal triangles of a triangle, ``(p, 3)`` barycentric."""
    i, j = np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij")
    places = [(i + 1 / 3, j + 1 / 3, i + j < parts), (i + 2 / 3, j + 2 / 3, i + j < parts - 1)]
    a, b = (
        np.concatenate([place[axis][place[2]] for place in places]) / parts for axis in range(2)
    )
    return np.stack([1 - a - b, a, b], axis=1)


def open_regions(
    load_cases: Sequence[LoadCaseSpec], part: Part, domain: DesignDomain, cell_size: float
) -> dict[str, float]:
    """Loaded regions with no passive region, skin or solid layer below them: their open shares.

    There the loads act on the cut walls and struts of cells, whose rims give way by themselves: the
    largest displacement of the region is theirs, and it depends on where the cells are cut.
    """
    names = dict.fromkeys(load.region for spec in load_cases for load in spec.load)
    share = {
        name: _open_share(part.regions[name], domain, DEPTH * cell_size)
        for name in names
        if name in part.regions
    }
    return {name: value for name, value in share.items() if value > OPEN}


def plate_key(region: str, cell_size: float) -> str:
    """Case keys that put a plate below a region."""
    return f'[[keep]] region = "{region}" with a margin of {PLATE * cell_size:.2g} mm or more'


def open_load_warnings(
    load_cases: Sequence[LoadCaseSpec], part: Part, domain: DesignDomain, cell_size: float
) -> tuple[str, ...]:
    """Say which regions carry loads on open lattice, and what helps."""
    return tuple(
        f"region {shown(name)} carries loads on open lattice ({value:.0%} of its area): cut rims "
        f"of cells give way by themselves there, and limits on largest values judge them; "
        f"{plate_key(name, cell_size)} makes a plate that spans the openings of the cells, and "
        f"[limits] mean_displacement judges the whole face instead of its softest rim"
        for name, value in open_regions(load_cases, part, domain, cell_size).items()
    )
