"""Resultants of loads before any mesh, and regions on which they act on open cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, lock, locked, plain_vector
from gradedesign.common.values.locate import Where, locating
from gradedesign.common.values.suggest import shown
from gradedesign.geometry.lattice.domain import LATTICE, DesignDomain, phase_at
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.triangles.surface_mesh import enclosed_centroid
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.region_load import region_resultant
from gradedesign.mechanics.material.material import Material

#: Resultants below this share of what acts are taken for zero. Chosen, not measured.
_CANCELLED = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadRow:
    """One load: its force and its moment about a point."""

    source: str  #: The region, or ``acceleration``.
    force: FloatArray  #: ``(3,)``, N.
    moment: FloatArray  #: ``(3,)``, N mm. About the point of the balance.
    gross: float  #: N. Local forces: of a pressure, also where its resultant is zero.

    def __post_init__(self) -> None:
        lock(self, force=(3,), moment=(3,))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadBalance:
    """The loads of one load case and their sum."""

    load_case: str
    about: FloatArray  #: ``(3,)``, mm. Area centroid of the held regions.
    rows: tuple[LoadRow, ...]
    force: FloatArray  #: ``(3,)``, N.
    moment: FloatArray  #: ``(3,)``, N mm.
    temperature_change: float  #: K. Uniform; it adds no force.
    cancels: bool  #: Something acts, but neither a force nor a moment is left of it.

    def __post_init__(self) -> None:
        for name in ("about", "force", "moment"):
            object.__setattr__(self, name, locked(getattr(self, name), (3,), name=name))


def load_balances(
    load_cases: Sequence[LoadCaseSpec], part: Part, density: float, where: Where
) -> tuple[LoadBalance, ...]:
    """Resultants of every load case.

    Raises CaseError if a region cannot carry the bearing load on it.

    ``density``, float, t/mm^3: of the solid material: an acceleration is taken to act on the solid
    part.
    """
    return tuple(
        _balance(spec, part, density, where, f"load_case[{number}]")
        for number, spec in enumerate(load_cases)
    )


def balance_warnings(balances: tuple[LoadBalance, ...]) -> tuple[str, ...]:
    """Say which load cases act on the part but leave nothing to its supports."""
    return tuple(
        f"load case {shown(balance.load_case)}: its loads cancel: "
        f"{sum(r.gross for r in balance.rows):.4g} N act, but they add up to no force and no "
        f"moment, so the supports carry nothing; is a direction wrong?"
        for balance in balances
        if balance.cancels
    )


def yielding_loads(
    load_cases: Sequence[LoadCaseSpec],
    part: Part,
    balances: Sequence[LoadBalance],
    material: Material,
    where: Where,
) -> tuple[str, ...]:
    """Say which loads, and which reactions, are beyond yield on the mean of their faces."""
    remarks = []
    for number, (spec, balance) in enumerate(zip(load_cases, balances, strict=True)):
        acting: list[tuple[str, str, float, tuple[str, ...]]] = [
            (f"load[{k}]", f"the load on region {shown(row.source)}", row.gross, (row.source,))
            for k, row in enumerate(balance.rows[: len(spec.load)])
        ]
        held = tuple(dict.fromkeys(fix.region for fix in spec.fix))
        reaction = float(np.linalg.norm(balance.force))
        acting.append(("fix", "the reaction on its held regions", reaction, held))
        for key, what, force, regions in acting:
            area = sum(part.regions[name].area for name in regions)
            if force > material.yield_strength * area:
                remarks.append(
                    f"{where(f'load_case[{number}].{key}')}: load case {shown(spec.name)}: "
                    f"{what}, {force:.4g} N on {area:.4g} mm^2, is {force / area:.4g} MPa on "
                    f"average, beyond the {material.yield_strength:g} MPa at which "
                    f"{material.name} yields; a larger region, or is a unit wrong?"
                )
    return tuple(remarks)


def load_case_data(
    load_cases: Sequence[LoadCaseSpec], balances: Sequence[LoadBalance]
) -> tuple[dict[str, Any], ...]:
    """Plain data of ``check --json`` and result.json: supports and loads of every load case."""
    return tuple(
        {
            "name": balance.load_case,
            "supports": [
                {
                    "region": fix.region,
                    "displacement_mm": list(fix.displacement),
                    "symmetry": fix.symmetry,
                }
                for fix in spec.fix
            ],
            "about_mm": plain_vector(balance.about),
            "loads": [
                {
                    "on": row.source,
                    "force_N": plain_vector(row.force),
                    "moment_N_mm": plain_vector(row.moment),
                }
                for row in balance.rows
            ],
            "force_N": plain_vector(balance.force),
            "moment_N_mm": plain_vector(balance.moment),
            "temperature_change_K": balance.temperature_change,
            "cancels": balance.cancels,
        }
        for spec, balance in zip(load_cases, balances, strict=True)
    )


def _held_centroid(spec: LoadCaseSpec, part: Part) -> FloatArray:
    """Area centroid of the regions that a load case holds, ``(3,)``, mm."""
    regions = [part.regions[name] for name in dict.fromkeys(f.region for f in spec.fix)]
    areas = np.array([region.area for region in regions])
    return np.asarray(areas @ np.array([region.centroid for region in regions]) / areas.sum())


def _balance(spec: LoadCaseSpec, part: Part, density: float, where: Where, key: str) -> LoadBalance:
    """Resultants of one load case, which the case states under ``key``."""
    about = _held_centroid(spec, part)
    rows = []
    for k, load in enumerate(spec.load):
        region = part.regions[load.region]
        with locating(where, f"{key}.load[{k}].bearing"):
            force, turn = region_resultant(region, load)
        stated = [load.force or 0.0, load.bearing or 0.0]
        gross = sum(float(np.linalg.norm(size)) for size in stated)
        gross += abs(load.pressure or 0.0) * region.area
        turns = np.array(load.moment or (0.0, 0.0, 0.0))
        if load.force is not None and load.point is not None:
            turns += np.cross(load.point - region.centroid, load.force)
        gross += float(np.linalg.norm(turns)) / _reach(region)
        moment = turn + np.cross(region.centroid - about, force)
        rows.append(LoadRow(source=load.region, force=force, moment=moment, gross=gross))
    if any(spec.acceleration):
        force = density * part.volume * np.array(spec.acceleration)
        arm = enclosed_centroid(part.surface) - about
        size = float(np.linalg.norm(force))
        moment = np.cross(arm, force)
        rows.append(LoadRow(source="acceleration", force=force, moment=moment, gross=size))
    force = sum((row.force for row in rows), np.zeros(3))
    moment = sum((row.moment for row in rows), np.zeros(3))
    gross = sum(row.gross for row in rows)
    imbalance = max(float(np.linalg.norm(force)), float(np.linalg.norm(moment)) / part.diagonal)
    return LoadBalance(
        load_case=spec.name,
        about=about,
        rows=tuple(rows),
        force=force,
        moment=moment,
        temperature_change=spec.temperature_change,
        cancels=gross > 0 and imbalance <= _CANCELLED * gross,
    )


def _reach(region: Region) -> float:
    """Arm of the forces that make up a moment on a region, mm."""
    return float(np.linalg.norm(np.ptp(region.corners.reshape(-1, 3), axis=0)))


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

    ``depth``, float, mm: below the surface at which solid is looked for.
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
