"""Acceptance: the exported surface, whole or in submodels, meshed by an independent route.

Both judge stress; displacements of the whole mesh stand beside the analysis that judges them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import counted, report_step, stepping
from gradedesign.design.acceptance.meshed_anew import EDGE_PER_SPACING, mesh_anew
from gradedesign.design.acceptance.submodel import SubmodelResult, analyse_submodel
from gradedesign.design.acceptance.submodel_choice import (
    BUFFERS,
    Room,
    Submodel,
    enlarged_submodel,
    most_stressed_submodels,
)
from gradedesign.errors import MeshError, ResourceError, SolverError
from gradedesign.geometry.contour.islands import largest_components
from gradedesign.geometry.lattice.domain import LATTICE
from gradedesign.geometry.tets.quality import tet_report
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.mechanics.explicit.analysis import Discretisation
from gradedesign.mechanics.explicit.explicit import ExplicitResult, measured
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhood_cells
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.support_zones import evaluated_at
from gradedesign.mechanics.explicit.tets import solve_tets
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec

#: Tetrahedra per second that pytetwild makes on lattice surfaces, measured 360 to 1200.
_TETWILD_RATE = 400.0
#: Share of the stated time that the mesher may be predicted to take for the whole lattice. Finite
#: cells judge displacements of the whole solid anyway, and pytetwild may take longer than is
#: predicted: a block of 4 x 4 x 4 gyroid sheets had not ended after 15 minutes where less than 10
#: were predicted.
_MESHER_SHARE = 1.0 / 60.0


class NoSubmodelError(MeshError):
    """No cell of lattice has room for a submodel around it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Acceptance:
    """Result of the independent analysis, of the whole printed surface or of submodels of it."""

    #: "whole", "submodels" or "none". None where the design is refused for a value that neither of
    #: them judges.
    scope: str
    whole: ExplicitResult | None  #: The analysis of the whole re-meshed lattice.
    submodels: tuple[SubmodelResult, ...]
    volume: float  #: mm^3. Solid volume that was re-meshed and judged.
    share: float  #: That volume over the whole solid's.
    attempts: tuple[str, ...]  #: Attempts of the mesher.
    refused: tuple[str, ...] = ()  #: What could not be chosen, meshed, solved or enlarged, and why.
    left_out: int = 0  #: Submodels that were chosen and could not be meshed or solved.
    failed: bool = False  #: Nothing could be meshed and solved that was to judge stress.

    @property
    def judged(self) -> float:
        """Share of the submodels that were chosen, or of the whole surface, that was analysed."""
        if self.failed:
            return 0.0
        chosen = len(self.submodels) + self.left_out
        return len(self.submodels) / chosen if chosen else 1.0


def nothing_meshed(words: str, left_out: int = 0) -> Acceptance:
    """The acceptance where no mesh of the printed surface could be made and solved, and why."""
    return Acceptance(
        scope="none", whole=None, submodels=(), volume=0.0, share=0.0, attempts=(),
        refused=(words,), left_out=left_out, failed=True,
    )  # fmt: skip


def choose_scope(requested: str, tets: float, time_s: float) -> str:
    """Whole where the mesher is predicted to end in a sixtieth of the time the case states.

    The time that is left plays no part: what is judged must not depend on how busy the machine is.

    ``requested``: "auto", "whole" or "submodels". ``tets``: that the mesher is expected to make of
    the whole surface. ``time_s``, s: [run] time.
    """
    if requested != "auto":
        return requested
    return "whole" if tets / _TETWILD_RATE < _MESHER_SHARE * time_s else "submodels"


def accept_whole(
    surface: SurfaceMesh,
    solid: PrintedSolid,
    *,
    size: float,
    time_limit_s: float,
) -> Acceptance:
    """Re-mesh and analyse the whole exported surface; ``size``, mm, sets edges and envelope."""
    began = time.perf_counter()
    with stepping("meshing the whole surface again"):
        meshed = mesh_anew(surface, solid, size, time_limit_s)
    mesh, dropped, _ = largest_components(
        meshed.mesh, keep=solid.design.domain.bodies, max_share=0.01
    )
    division = Discretisation(
        made_by=solid.mesher.name,
        mesh_size=EDGE_PER_SPACING * meshed.size,
        unknowns=0,
        requested=EDGE_PER_SPACING * size,
        dropped_components=dropped,
        seconds=time.perf_counter() - began,
    )
    result = measured(solve_tets(mesh, solid, division, 0.5 * size), solid, began)
    return Acceptance(
        scope="whole",
        whole=result,
        submodels=(),
        volume=tet_report(mesh).volume,
        share=tet_report(mesh).volume / enclosed_volume(surface),
        attempts=meshed.attempts,
    )


def accept_submodels(
    surface: SurfaceMesh,
    solid: PrintedSolid,
    explicit: ExplicitResult,
    *,
    count: int,
    size: float,
    time_limit_s: float,
    on_submodel: Callable[[SubmodelResult], None] | None = None,
) -> Acceptance:
    """Re-mesh and analyse the most stressed cells as submodels.

    A submodel whose boundary force or energy misses 3 % is enlarged once, where it has room and the
    memory holds it. One that cannot be meshed or solved is left out and told in ``refused``.

    Raises NoSubmodelError if no submodel can be chosen.

    - ``surface``: the exported surface, read back
    - ``explicit``: chooses the submodels and drives them
    - ``count``: submodels at most
    - ``size``, mm: surface size of their meshes
    - ``time_limit_s``, s: of the mesher, for all submodels
    - ``on_submodel``: hears every analysed submodel
    """
    avoid = [solid.regions[name].corners for name in sorted(_held_and_loaded(solid.load_cases))]
    report_step("choosing the most stressed cells")
    submodels = _chosen_submodels(solid, explicit, count, avoid)
    results, refused, left_out = [], list[str](), 0
    for submodel in counted(submodels, "submodel", len(submodels)):

        def analysed(submodel: Submodel) -> SubmodelResult:
            result = analyse_submodel(
                surface, submodel, explicit, solid, size=size,
                time_limit_s=time_limit_s / len(submodels),
            )  # fmt: skip
            if on_submodel is not None:
                on_submodel(result)
            return result

        try:
            result = analysed(submodel)
        except (MeshError, ResourceError, SolverError) as error:
            refused.append(f"the submodel at {_place(submodel)} mm was left out: {error}")
            left_out += 1
            continue
        larger = None if result.matches else enlarged_submodel(submodel, avoid)
        if larger is not None:
            try:
                result = analysed(larger)
            except (MeshError, ResourceError, SolverError) as error:
                refused.append(f"the submodel at {_place(submodel)} mm was not enlarged: {error}")
        results.append(result)
    if not results:
        return nothing_meshed("; ".join(refused), left_out)
    volume = sum(r.volume for r in results)
    return Acceptance(
        scope="submodels",
        whole=None,
        submodels=tuple(results),
        volume=volume,
        share=volume / explicit.volume,
        attempts=tuple(a for r in results for a in r.attempts),
        refused=tuple(refused),
        left_out=left_out,
    )


def _chosen_submodels(
    solid: PrintedSolid, explicit: ExplicitResult, count: int, avoid: Sequence[FloatArray]
) -> tuple[Submodel, ...]:
    """The most stressed cells with room for a buffer around them."""
    for buffer in BUFFERS:
        submodels = most_stressed_submodels(
            explicit.solved.points,
            explicit.solved.volumes,
            explicit.von_mises,
            _eligible_lattice(solid, explicit),
            percentile=solid.percentile,
            cells=neighbourhood_cells(solid.design),
            count=count,
            room=Room(avoid=avoid, buffer=buffer),
        )
        if submodels:
            return submodels
    raise NoSubmodelError(
        "no submodel can be chosen: every cell of lattice lies within the exclusion radius of a "
        "clamped region or reaches a held or loaded region; reduce [limits] exclusion_radius "
        'or set [run] acceptance = "whole"'
    )


def _place(submodel: Submodel) -> tuple[float, ...]:
    return tuple(round(c, 1) for c in submodel.centre)


def _held_and_loaded(load_cases: Sequence[LoadCaseSpec]) -> set[str]:
    """Regions that supports or loads act on."""
    supported = {fix.region for spec in load_cases for fix in spec.fix}
    return supported | {load.region for spec in load_cases for load in spec.load}


def _eligible_lattice(solid: PrintedSolid, explicit: ExplicitResult) -> BoolArray:
    """Sample points of lattice outside the exclusion radius of clamped regions, ``(n,)``."""
    outside = evaluated_at(explicit.solved.points, solid.support_zones)
    return (explicit.phase == LATTICE) & outside
