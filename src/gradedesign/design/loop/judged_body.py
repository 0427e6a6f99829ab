"""A body made elsewhere, judged by the limits of a case as acceptance judges a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.design.acceptance.whole_solid import WholeStage
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.accepted import body_fitted, corrected_rows
from gradedesign.design.loop.accepted_rows import unjudged_words, without_band
from gradedesign.design.loop.analysed import printed_solid
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.bodies import judge_bodies, with_other_body
from gradedesign.design.loop.ended import Ended
from gradedesign.design.loop.iteration_steps import build_design
from gradedesign.design.loop.printed_stage import surface_stage
from gradedesign.design.printing.as_built_body import as_built_body
from gradedesign.design.printing.wall_thickness import (
    PERCENTILES,
    WallThickness,
    surface_rays,
    wall_thickness,
)
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.triangles.printed_field import printed_field
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    integral_mean_curvature,
)
from gradedesign.mechanics.explicit.analysis import SURFACE_PER_ELEMENT, PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.explicit.grid_resolution import elements_across
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.small_solid import small_solid_spacing
from gradedesign.mechanics.explicit.yielding import yielding_words
from gradedesign.mechanics.fe.modes import mode_room
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.limit import Limit, limits_stress, mode_goals
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import all_hold

#: Percentile of the thickness, by area, from which the first elements follow: what is thinner is
#: mostly rims of sheets that faces cut. Chosen, not measured.
_THIN = 10.0
#: Over the part's diagonal: how far a body may reach beyond the part before it is taken to be
#: another part's, or in another unit, and how far before it is said. Chosen, not measured.
_BEYOND, _SAID = 0.01, 0.001
#: Points of a region at which it is looked whether the body is there, and the share of its area
#: below which it is said: a part of a bolt circle of a hundred is a part of its load. Chosen, not
#: measured.
_LOOKS, _WHOLE = 20_000, 0.99
#: What limits call the place of the cells, and what a body made elsewhere has there.
_IN_CELLS, _IN_BODY = " in lattice", " in the body outside kept solid"
_AS_IS = "the body is judged as it is, and nothing is designed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedBody:
    """A body with its limits.

    - ``ended``: what was judged and what not, in words
    - ``element``, mm: edge of the finest elements
    """

    body: Part
    rows: tuple[LimitRow, ...]
    holds: bool
    ended: Ended
    thickness: WallThickness
    element: float
    yields: tuple[str, ...]
    warnings: tuple[str, ...]


def judge_body(model: DesignModel, body: Part, announce: Announcer) -> JudgedBody:
    """Judge a closed body in place of the part by the loads and limits of a case.

    Finite cells analyse it from two resolutions on, the first of which follows its thickness, and
    an independent mesher judges its stress, as for the printed surface of a design.

    Raises CaseError if the body reaches beyond the part, and `LatticeError`, `MeshError`,
    `ResourceError` or `SolverError` as acceptance does.

    Parameters
    ----------
    model : DesignModel
        With its solid part analysed, from which relative limits follow.
    body : Part
        As read.
    """
    plan, case, limits, surface = model.plan, model.plan.case, model.limits, body.surface
    run = case.run
    beyond = _require_within(plan.part, plan.domain, body)
    thickness = wall_thickness(surface, percentiles=(*PERCENTILES, _THIN))
    planned = _planned(limits, body, load_cases=len(case.load_case))
    follows, spacing = _first_elements(run, planned, body, thickness)
    middle = float(np.sqrt(np.prod(model.cells.bounds)))
    solid = printed_solid(model, build_design(plan.domain, model.cells, middle))
    size = model.cells.layout.typical / 2.0
    built = as_built_body(plan.process, surface, plan.part.surface, size)

    def staged(printed: SurfaceMesh, of: PrintedSolid) -> WholeStage:
        return surface_stage(
            limits,
            run,
            printed,
            of,
            planned,
            spacing=spacing,
            unknowns=0,
            on_event=announce.listener,
        )

    with announce.stage("acceptance"):
        bodies = judge_bodies(limits, staged, solid, surface, built, announce)
        found = bodies.whole
        remeshing = (body.volume, SURFACE_PER_ELEMENT * max(follows, found.result.mesh_size))
        acceptance = body_fitted(limits, run, bodies, remeshing, announce)
    rows = _with_its_words(with_other_body(bodies, corrected_rows(limits, found.rows, acceptance)))
    announce.limits("acceptance", rows)
    unjudged = unjudged_words(rows, (*found.refused, *bodies.refused), acceptance.refused)
    if not rows:
        raise CaseError(
            f"{case.where('limits')}: none of them can be judged on a body made elsewhere, of "
            f"which no cells are known; expected e.g. a displacement or a stress"
        )
    known = {row.key for row in rows}
    left = [_named(limit) for limit in limits if not (limit.key in known or limit.may_lack)]
    words = (_AS_IS, unjudged, left and f"not judged: {', '.join(left)}")
    return JudgedBody(
        body=body,
        rows=rows,
        holds=all_hold(rows) and not without_band(rows),
        ended=Ended(by="judged", words="; ".join(text for text in words if text)),
        thickness=thickness,
        element=found.result.mesh_size,
        yields=yielding_words(found.result.yields, "the body", limited=limits_stress(limits)),
        warnings=(
            *body.report.warnings,
            *_hot_spots(limits, found.result),
            *_beyond_words(beyond, plan.part.diagonal),
            *_missing_words(body, [plan.part.regions[name] for name in model.facets], plan.part),
            *(
                f"{name}: not judged: it is known of the homogenised lattice alone, and what cells "
                "a body made elsewhere has is not known"
                for name in left
            ),
        ),
    )


def _with_its_words(rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows of a body made elsewhere, which has no lattice in the place of the case's cells."""
    return tuple(replace(row, name=row.name.replace(_IN_CELLS, _IN_BODY)) for row in rows)


def _hot_spots(limits: Sequence[Limit], analysis: Analysis) -> list[str]:
    """Sentences of limits of fatigue on the largest stress, in the words of such a body."""
    told = [words for limit in limits for words in limit.hot_spots(analysis)]
    return [words.replace(_IN_CELLS, _IN_BODY) for words in told]


def _first_elements(
    run: RunSpec, planned: PlannedSolid, body: Part, thickness: WallThickness
) -> tuple[float, float]:
    """Edges of elements that the thickness asks for, and of those that are taken first, mm."""
    area = float(np.linalg.norm(area_vectors(body.surface), axis=1).sum())
    across = run.elements_per_wall or elements_across(body.volume, area, planned.curvature)
    follows = run.explicit_mesh_size or thickness.percentiles_mm[f"{_THIN:g}"] / across
    fine = small_solid_spacing(FINITE_CELLS, planned, follows, stated=run.states_resolution)
    return follows, FINITE_CELLS.fitted_spacing(planned, fine, run.memory)


def _named(limit: Limit) -> str:
    """A limit with its load case, where it has one."""
    return f"{limit.name} ({limit.key.load_case})" if limit.key.load_case else limit.name


def _planned(limits: Sequence[Limit], body: Part, *, load_cases: int) -> PlannedSolid:
    """Size of a body, from which the cost of its analysis follows."""
    x, y, z = np.ptp(body.surface.vertices, axis=0).tolist()
    return PlannedSolid(
        box=(x, y, z),
        volume=body.volume,
        projections=float(np.abs(area_vectors(body.surface)).sum()),
        curvature=integral_mean_curvature(body.surface),
        load_cases=load_cases,
        goals=sum(limit.goal() is not None for limit in limits),
        modes=mode_room(mode_goals(limits).values()),
    )


def _require_within(part: Part, domain: DesignDomain, body: Part) -> float:
    """Largest distance by which a body reaches beyond the part, mm; refuses more than a little."""
    beyond = float(domain.distance(body.surface.vertices.T).max())
    if beyond > _BEYOND * part.diagonal:
        raise CaseError(
            f"{body.source} reaches {beyond:.4g} mm beyond the part {part.source}, whose diagonal "
            f"is {part.diagonal:.4g} mm; expected a body inside the part, in its place: check its "
            f"units and its origin"
        )
    return max(beyond, 0.0)


def _beyond_words(beyond: float, diagonal: float) -> tuple[str, ...]:
    """Sentence on a body that is a little larger than the part; empty without any."""
    if beyond <= _SAID * diagonal:
        return ()
    return (f"the body reaches {beyond:.3g} mm beyond the part",)


def _missing_words(body: Part, regions: Sequence[Region], part: Part) -> tuple[str, ...]:
    """Sentences on regions that loads, supports or limits name and the body has in part only."""
    depth = _SAID * part.diagonal
    field, words = printed_field(body.surface, depth), list[str]()
    for region in regions:
        vertices = region.corners.reshape(-1, 3)
        faces = np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)
        points, inward = surface_rays(SurfaceMesh(vertices=vertices, faces=faces), _LOOKS)
        share = float((field(points + depth * inward) < 0.0).mean())
        if share < _WHOLE:
            words.append(
                f"region '{region.name}': the body has {share:.0%} of its area, which carries or "
                f"is held instead of the whole"
            )
    return tuple(words)
