"""The designed body and the one that the process builds of it, both judged by finite cells."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import counted, stepping
from gradedesign.design.acceptance.whole_resolution import RATIO
from gradedesign.design.acceptance.whole_solid import WholeJudgement, WholeStage, judge_whole
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.printing.as_built_body import AsBuiltBody
from gradedesign.errors import LatticeError, MeshError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import limit_rows

#: Words on the bodies in rows and messages.
NOMINAL, AS_BUILT = "nominal", "as built"
_AS_BUILT_JUDGE = "finite cells on the whole as-built surface"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """The bodies of a printed file: as designed, and as its process builds it.

    The first of them is judged as every printed surface is. The other one is judged at the next
    coarser pair of resolutions, with the band that follows from these.
    """

    judged: str  #: "nominal", "as_built" or "both". Of which the limits must hold.
    surface: SurfaceMesh  #: Of the first: the as-built one where that alone is judged.
    solid: PrintedSolid  #: Its loads, supports and material.
    whole: WholeJudgement
    #: Of the other body; empty without a process of which a body is known.
    beside: tuple[LimitRow, ...] = ()
    #: Resolutions of the other body that could not be analysed, and why.
    refused: tuple[str, ...] = ()
    #: Why the as-built body could not be judged where the designed one alone decides; else empty.
    unknown: str = ""
    #: By body. Solid of the elements.
    volumes_mm3: Mapping[str, float] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)  #: By body. That its judgement took.
    built: AsBuiltBody | None = None
    #: ``analyse_built(surface, spacing)``: an as-built surface by elements of a spacing, mm.
    analyse_built: Callable[[SurfaceMesh, float], ExplicitResult] | None = None
    spacing: float = 0.0  #: mm. Of the coarsest analysis of the as-built body.

    @property
    def first_is_built(self) -> bool:
        """Whether the as-built body is the first."""
        return self.judged == "as_built"

    @property
    def rows_as_built(self) -> tuple[LimitRow, ...]:
        """Rows of the as-built body, without any independent mesh."""
        return self.whole.rows if self.first_is_built else self.beside


def judge_bodies(
    limits: Sequence[Limit],
    staged: Callable[[SurfaceMesh, PrintedSolid], WholeStage],
    solid: PrintedSolid,
    surface: SurfaceMesh,
    built: AsBuiltBody | None,
    announce: Announcer,
) -> Bodies:
    """Judge a printed surface, and where the case has a process the body that is built of it.

    Raises LatticeError if no resolution holds a body that decides, such as one whose walls vanish
    as built.

    ``staged``: analyses of a surface with its loads, supports and material. ``built``: of the
    surface.
    """
    if built is None:
        whole = judge_whole(limits, staged(surface, solid))
        return Bodies(judged=NOMINAL, surface=surface, solid=solid, whole=whole)
    building = built.building
    printed = replace(solid, material=building.process.printed(solid.material, building.up))
    bodies = {NOMINAL: (surface, solid), AS_BUILT: (built.surface, printed)}
    judged = built.stated.judged
    order = (AS_BUILT, NOMINAL) if judged == "as_built" else (NOMINAL, AS_BUILT)
    found, seconds, volumes = dict[str, WholeJudgement](), {}, {}
    spacing, unknown = 0.0, ""
    for body, ratio in zip(order, (1.0, RATIO), strict=True):
        began = time.perf_counter()
        try:
            stage = staged(*bodies[body])
            stage = replace(stage, spacing=ratio * stage.spacing)
            if body == AS_BUILT:
                stage = replace(stage, judged_by=_AS_BUILT_JUDGE)
            spacing = max(spacing, stage.spacing)
            with stepping(f"{body} body"):
                found[body] = judge_whole(limits, stage)
        except (LatticeError, MeshError) as error:
            unknown = f"{body}: {error}"
            if judged != NOMINAL or body == NOMINAL:
                raise LatticeError(unknown) from error
            continue
        seconds[body] = time.perf_counter() - began
        volumes[body] = found[body].result.volume
        announce.took(f"{body} surface", seconds[body])
    return Bodies(
        judged=judged,
        surface=bodies[order[0]][0],
        solid=bodies[order[0]][1],
        whole=found[order[0]],
        beside=found[order[1]].rows if order[1] in found else (),
        refused=found[order[1]].refused if order[1] in found else (),
        unknown=unknown,
        volumes_mm3=volumes,
        seconds=seconds,
        built=built,
        analyse_built=lambda one, size: staged(one, printed).analyse(size),
        spacing=spacing,
    )


def with_other_body(bodies: Bodies, rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows of the first body with the values of the other one; the worse one where both count.

    Where an independent mesh corrected the stress of the first body, its ratio to the finite cells
    is taken for the other one too.
    """
    if not bodies.beside:
        return tuple(rows)
    before = {row.key: row for row in bodies.whole.rows}
    beside = {row.key: row for row in bodies.beside}
    out = []
    for row in rows:
        other = beside.get(row.key)
        if other is None:
            out.append(row)
            continue
        found = before[row.key]
        if row.judged_by != found.judged_by and not row.converges and found.value:
            ratio = row.value / found.value
            factor = Banded(value=ratio, low=ratio, high=ratio)
            words = f"{other.judged_by} times the ratio of the independent mesh"
            other = replace(other.scaled(factor, words), remeshed=row.remeshed)
        built, plain = (row, other) if bodies.first_is_built else (other, row)
        decides = other if bodies.judged == "both" and _worse(other, row) else row
        out.append(replace(decides, nominal=plain.value, as_built=built.value))
    return tuple(out)


def _worse(one: LimitRow, other: LimitRow) -> bool:
    """Whether a row is nearer to breaking its limit than another one."""
    return (not one.passed, one.utilisation) > (not other.passed, other.utilisation)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Values of a limit over random as-built bodies."""

    limit: str
    load_case: str
    unit: str
    mean: float  #: Mean, 5th and 95th percentile, in ``unit``.
    low: float  #: Mean, 5th and 95th percentile, in ``unit``.
    high: float  #: Mean, 5th and 95th percentile, in ``unit``.
    held: float  #: Share of the bodies that hold the limit.


def variant_spreads(limits: Sequence[Limit], bodies: Bodies) -> tuple[Spread, ...]:
    """Limits over the random as-built bodies that the case asks for, each analysed once.

    Every value is that of its body over the one of the as-built body without scatter at the same
    resolution, times the decisive value of the latter: what small elements would change cancels.
    """
    built, analyse = bodies.built, bodies.analyse_built
    if built is None or analyse is None or not built.stated.variants or bodies.unknown:
        return ()
    rows = {row.key: row for row in bodies.rows_as_built}

    def values(surface: SurfaceMesh) -> dict[LimitKey, float]:
        result = analyse(surface, bodies.spacing)
        return {row.key: row.value for row in limit_rows(limits, result, "")}

    base, count = values(built.surface), built.stated.variants
    found: dict[LimitKey, list[float]] = {}
    for number in counted(range(1, count + 1), "as-built variant", count):
        for key, value in values(built.variant(number)).items():
            if base.get(key):
                found.setdefault(key, []).append(value / base[key] * rows[key].decisive)
    return tuple(_spread(rows[key], np.array(each)) for key, each in found.items())


def _spread(row: LimitRow, values: FloatArray) -> Spread:
    """Mean and percentiles of the values of a limit."""
    holds = values <= row.limit if row.unfavourable == "high" else values >= row.limit
    low, high = np.quantile(values, [0.05, 0.95])
    return Spread(
        limit=row.name,
        load_case=row.load_case,
        unit=row.unit,
        mean=float(values.mean()),
        low=float(low),
        high=float(high),
        held=float(holds.mean()),
    )
