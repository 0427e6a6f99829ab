"""The design that pictures and files show, with the measures of its exported surface."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gradedesign.arrays import FloatArray
from gradedesign.design.acceptance.printed_body import PrintedBody, measure_printed
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.bodies import Spread
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.printing.as_built_body import AsBuiltBody, as_built_body
from gradedesign.design.printing.print_checks import check_printed
from gradedesign.design.printing.printability import Printability
from gradedesign.design.resolve.plan import Plan
from gradedesign.geometry.lattice.components.joint import joint_volume
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.mechanics.explicit.explicit import ExplicitResult, governing_load_case
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.sizing.members import MemberField


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """The design that pictures and files show: the judged one, or the best that was found."""

    rho: FloatArray  #: ``(M,)``. Density of every tetrahedron of the part.
    analysed: Analysed
    surface: SurfaceMesh  #: As exported.
    fields: SurfaceFields  #: Of the explicit analysis in the load case that governs.
    printed: PrintedBody  #: Measures of the exported surface.
    printability: Printability | None  #: How it is made, where the case has ``[print]``.
    #: Limits by the explicit analysis, with bands; empty where acceptance judged the design.
    rows: tuple[LimitRow, ...] = ()
    remeshed: ExplicitResult | None = None  #: Its acceptance, where its whole surface was meshed.
    members: MemberField | None = None  #: Of its solid members.
    built: AsBuiltBody | None = None  #: What the process of the case builds of that surface.
    #: Limits over random as-built bodies, where the case asks for them.
    spreads: tuple[Spread, ...] = ()


def shown_of(
    plan: Plan,
    design: DesignIteration,
    analysed: Analysed,
    surface: SurfaceMesh,
    rows: tuple[LimitRow, ...] = (),
    remeshed: ExplicitResult | None = None,
    built: AsBuiltBody | None = None,
) -> Shown:
    """Measure the exported surface of an analysed design; the last three as in `Shown`."""
    solved = analysed.result.solved
    fields = solved.surface_fields(governing_load_case(analysed.result))
    printed = measure_printed(
        surface,
        fields.surface,
        solved.division.surface_size,
        analysed.design.domain,
        elements_mm3=float(solved.volumes.sum()),
    )
    return Shown(
        rho=design.rho,
        members=design.members,
        analysed=analysed,
        surface=surface,
        fields=fields,
        printed=replace(printed, joints_mm3=joint_volume(analysed.design)),
        remeshed=remeshed,
        printability=check_printed(plan.case.print, plan.part.surface, surface, printed.thickness),
        rows=rows,
        built=built
        or as_built_body(plan.process, surface, plan.part.surface, analysed.layout.typical / 2.0),
    )
