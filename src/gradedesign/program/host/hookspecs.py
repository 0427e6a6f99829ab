"""Every extension point: what a plugin may register.

A hook takes no argument and returns an iterable of records. It is called once, when the registry
is built, never inside a numerical loop. The built-in records go through the same hooks. Above 300
lines: every hook, with an example, in one place.
"""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign.design.printing.process import Process
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.maker import CellMaker
from gradedesign.geometry.formats.exporter import Exporter
from gradedesign.geometry.lattice.component_kind import ComponentKind
from gradedesign.geometry.lattice.field_reader import FieldReader
from gradedesign.geometry.part.reader import PartReader
from gradedesign.geometry.part.repairer import Repairer
from gradedesign.geometry.tets.mesher import Mesher
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.solver.eigen_solver import EigenSolver
from gradedesign.mechanics.solver.linear_solver import LinearSolver
from gradedesign.program.host.command import gradedesign_commands
from gradedesign.program.host.markers import GROUP, hookimpl, hookspec
from gradedesign.program.outputs.output import Output
from gradedesign.program.outputs.report_section import ReportSection

__all__ = ["GROUP", "gradedesign_commands", "hookimpl", "hookspec"]


@hookspec
def gradedesign_cell_families() -> Iterable[CellFamily]:
    """Register cell families.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import CellFamily, hookimpl
    >>> def simple_cubic(u):
    ...     return np.sort(np.hypot(*np.abs(u - np.round(u))[[[0, 1, 2], [1, 2, 0]]]), axis=0)[0]
    >>> @hookimpl
    ... def gradedesign_cell_families():
    ...     yield CellFamily(name="simple-cubic", shape=simple_cubic, distance=True)
    >>> [family.name for family in gradedesign_cell_families()]
    ['simple-cubic']
    """
    return ()


@hookspec
def gradedesign_cell_makers() -> Iterable[CellMaker]:
    """Register what makes a cell of the data or the file that a case names.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import CellFamily, CellMaker, hookimpl
    >>> def waves(name, counts):
    ...     k = 2 * np.pi * np.asarray(counts, float).reshape(3, 1)
    ...     return CellFamily(
    ...         name=name, shape=lambda u: np.cos(np.tensordot(k[:, 0], u, axes=1)), symmetry="none"
    ...     )
    >>> @hookimpl
    ... def gradedesign_cell_makers():
    ...     yield CellMaker(name="waves", make=waves, options={"counts": "waves along x, y, z"})
    >>> [maker.name for maker in gradedesign_cell_makers()]
    ['waves']
    """
    return ()


@hookspec
def gradedesign_scaling_laws() -> Iterable[ScalingLaw]:
    """Register laws that give stiffness and strength of a cell as functions of density.

    Examples
    --------
    >>> from gradedesign import LawOrigin, hookimpl, power_law
    >>> @hookimpl
    ... def gradedesign_scaling_laws():
    ...     yield power_law(
    ...         "me-2026-simple-cubic", ("simple-cubic",),
    ...         youngs=(0.7, 1.3), strength=(0.5, 1.2), window=(0.1, 0.5),
    ...         origin=LawOrigin(
    ...             kind="fe", source="my thesis, table 2", test="periodic cell, quadratic tets"
    ...         ),
    ...     )
    >>> [law.window for law in gradedesign_scaling_laws()]
    [(0.1, 0.5)]
    """
    return ()


@hookspec
def gradedesign_materials() -> Iterable[Material]:
    """Register base materials (MPa, t/mm^3, 1/K).

    Examples
    --------
    >>> from gradedesign import Material, hookimpl
    >>> @hookimpl
    ... def gradedesign_materials():
    ...     yield Material(
    ...         name="my-resin", youngs_modulus=2800.0, poissons_ratio=0.35, density=1.18e-9,
    ...         yield_strength=55.0, source="data sheet 2026-01",
    ...     )
    >>> [material.name for material in gradedesign_materials()]
    ['my-resin']
    """
    return ()


@hookspec
def gradedesign_processes() -> Iterable[Process]:
    """Register printing processes: how they change what they build (degrees, mm).

    Examples
    --------
    >>> from gradedesign import Process, hookimpl
    >>> @hookimpl
    ... def gradedesign_processes():
    ...     yield Process(
    ...         name="my-printer", strut_size=((0.0, 0.12), (90.0, 0.03)), scatter=0.02,
    ...         material="Ti-6Al-4V", samples=24, source="coupons of 2026-03",
    ...     )
    >>> [process.name for process in gradedesign_processes()]
    ['my-printer']
    """
    return ()


@hookspec
def gradedesign_readers() -> Iterable[PartReader]:
    """Register file formats from which a part can be read.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import FileFaces, PartReader, hookimpl, raw_triangles
    >>> def read_corners(path):
    ...     rows = np.loadtxt(path)  # nine coordinates and the number of a face
    ...     faces = FileFaces(label=rows[:, 9], names={3: "bolt hole"}, colors={3: "#ff0000"})
    ...     return raw_triangles(rows[:, :9].reshape(-1, 3, 3), source=path.name, faces=faces)
    >>> @hookimpl
    ... def gradedesign_readers():
    ...     yield PartReader(name="corners", suffixes=(".corners",), read=read_corners)
    >>> [reader.suffixes for reader in gradedesign_readers()]
    [('.corners',)]
    """
    return ()


@hookspec
def gradedesign_field_readers() -> Iterable[FieldReader]:
    """Register files from which a stated density, or directions of cells, can be read.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import FieldReader, hookimpl
    >>> def layers(request):
    ...     values = np.loadtxt(request.spec.points)  # a density for each mm of height
    ...     return lambda points: np.interp(points[2] - request.lower[2], *np.ogrid[:9], values)
    >>> @hookimpl
    ... def gradedesign_field_readers():
    ...     yield FieldReader(name="points", density=layers)
    >>> [reader.name for reader in gradedesign_field_readers()]
    ['points']
    """
    return ()


@hookspec
def gradedesign_repairers() -> Iterable[Repairer]:
    """Register what mends the surface of a part, which ``[part] repair`` names.

    Examples
    --------
    >>> from gradedesign import Repairer, hookimpl
    >>> @hookimpl
    ... def gradedesign_repairers():
    ...     yield Repairer(
    ...         name="my-repair", worker="my_repair.worker", options={"edge": "longest edge, mm"}
    ...     )
    >>> [repairer.worker for repairer in gradedesign_repairers()]
    ['my_repair.worker']
    """
    return ()


@hookspec
def gradedesign_exporters() -> Iterable[Exporter]:
    """Register file formats in which the printed lattice can be written.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import Exporter, hookimpl
    >>> def write_corners(path, lattice):
    ...     surface = lattice.surface
    ...     np.savetxt(path, surface.vertices[surface.faces].reshape(-1, 9))
    >>> @hookimpl
    ... def gradedesign_exporters():
    ...     yield Exporter(name="corners", suffix=".corners", write=write_corners)
    >>> [exporter.name for exporter in gradedesign_exporters()]
    ['corners']
    """
    return ()


@hookspec
def gradedesign_outputs() -> Iterable[Output]:
    """Register files about a finished run that ``[output] formats`` can name.

    Examples
    --------
    >>> from gradedesign import Output, hookimpl
    >>> def write_mass(run):
    ...     mass = run.result().mass_g
    ...     run.write("mass.txt", lambda path: path.write_text(f"{mass} g"), key="mass")
    ...     return ()
    >>> @hookimpl
    ... def gradedesign_outputs():
    ...     yield Output(name="mass", write=write_mass)
    >>> [output.name for output in gradedesign_outputs()]
    ['mass']
    """
    return ()


@hookspec
def gradedesign_report_sections() -> Iterable[ReportSection]:
    """Register sections of the report: paragraphs and tables that follow from the result.

    Examples
    --------
    >>> from gradedesign import ReportSection, ReportTable, hookimpl
    >>> def price(result):
    ...     if result.mass_g is not None:
    ...         yield "Of powder alone, at 0.40 EUR/g."
    ...         cost = f"{0.40 * result.mass_g:.2f}"
    ...         yield ReportTable(header=("", "EUR"), rows=(("powder", cost),), right=(1,))
    >>> @hookimpl
    ... def gradedesign_report_sections():
    ...     yield ReportSection(name="price", title="Price", content=price)
    >>> [section.title for section in gradedesign_report_sections()]
    ['Price']
    """
    return ()


@hookspec
def gradedesign_solvers() -> Iterable[LinearSolver]:
    """Register linear solvers, which ``[run] solver`` names.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import LinearAnswer, LinearSolver, hookimpl
    >>> def prepare(system):
    ...     free = np.flatnonzero(system.free)
    ...     inverse = np.linalg.inv(system.matrix.toarray()[np.ix_(free, free)])
    ...     def solve(right, start, rtol):
    ...         x = np.zeros_like(right)
    ...         x[:, free] = right[:, free] @ inverse
    ...         return LinearAnswer(x=x)
    ...     return solve
    >>> @hookimpl
    ... def gradedesign_solvers():
    ...     yield LinearSolver(name="my-inverse", prepare=prepare, most_unknowns=3000)
    >>> [solver.name for solver in gradedesign_solvers()]
    ['my-inverse']
    """
    return ()


@hookspec
def gradedesign_eigen_solvers() -> Iterable[EigenSolver]:
    """Register eigenvalue solvers, which ``homogenise --buckling --eigen-solver`` names.

    Examples
    --------
    >>> import numpy as np
    >>> from gradedesign import EigenSolver, ExtremeValue, hookimpl
    >>> def power_iteration(problem):
    ...     x = problem.start
    ...     for _ in range(200):
    ...         x = problem.solve(problem.form(x))
    ...         x /= np.linalg.norm(x)
    ...     value = float(x @ problem.form(x)) / float(x @ problem.stiffness(x))
    ...     return ExtremeValue(value=value, vector=x), None
    >>> @hookimpl
    ... def gradedesign_eigen_solvers():
    ...     yield EigenSolver(name="my-power-iteration", solve=power_iteration)
    >>> [solver.name for solver in gradedesign_eigen_solvers()]
    ['my-power-iteration']
    """
    return ()


@hookspec
def gradedesign_meshers() -> Iterable[Mesher]:
    """Register what fills a closed surface with tetrahedra.

    Examples
    --------
    >>> from gradedesign import Mesher, hookimpl
    >>> @hookimpl
    ... def gradedesign_meshers():
    ...     yield Mesher(name="my-mesher", worker="my_mesher.worker", version="1.0")
    >>> [mesher.worker for mesher in gradedesign_meshers()]
    ['my_mesher.worker']
    """
    return ()


@hookspec
def gradedesign_limits() -> Iterable[LimitKind]:
    """Register kinds of limits, which add a list of tables to ``[limits]`` under their name.

    Examples
    --------
    >>> from gradedesign import LimitEntry, LimitKind, StatedLimit, hookimpl
    >>> class StrokeEntry(LimitEntry):
    ...     region: str
    >>> def stated(limits, load_cases, material):
    ...     return [
    ...         StatedLimit(name=f"stroke of {one.region}", load_case="every", allowed="1 mm")
    ...         for one in limits.stroke
    ...     ]
    >>> @hookimpl
    ... def gradedesign_limits():
    ...     yield LimitKind(
    ...         name="stroke",
    ...         entry=StrokeEntry,
    ...         stated=stated,
    ...         make=lambda limits, placed: ((), ()),
    ...     )
    >>> [kind.name for kind in gradedesign_limits()]
    ['stroke']
    """
    return ()


@hookspec
def gradedesign_components() -> Iterable[ComponentKind]:
    """Register kinds of components of a lattice, which add a list of tables to ``[lattice]``.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from gradedesign import ComponentEntry, ComponentKind, SolidComponent, hookimpl
    >>> class FloorEntry(ComponentEntry):
    ...     height: float
    >>> @dataclass(frozen=True, slots=True, kw_only=True, eq=False)
    ... class Floor(SolidComponent):
    ...     height: float
    ...     def distance(self, points, to_part):
    ...         return points[2] - self.height
    >>> def make(place):
    ...     return [Floor(name="floor", height=one.height) for one in place.lattice.floor], ()
    >>> @hookimpl
    ... def gradedesign_components():
    ...     yield ComponentKind(name="floor", stage="solid", entry=FloorEntry, make=make)
    >>> [kind.name for kind in gradedesign_components()]
    ['floor']
    """
    return ()


@hookspec
def gradedesign_analyses() -> Iterable[ExplicitAnalysis]:
    """Register explicit analyses of the printed solid, which ``[run] analysis`` names.

    Examples
    --------
    >>> from gradedesign import AnalysisEstimate, ExplicitAnalysis, hookimpl
    >>> def solve(solid, resolution, say):
    ...     ...  # returns a gradedesign.SolvedSolid
    >>> def estimate(planned, spacing):
    ...     unknowns = int(24 * planned.volume / spacing**3)
    ...     return AnalysisEstimate(
    ...         unknowns=unknowns, memory_bytes=900 * unknowns, mesh_s=2.0,
    ...         solve_s=3e-5 * unknowns,
    ...     )
    >>> @hookimpl
    ... def gradedesign_analyses():
    ...     yield ExplicitAnalysis(
    ...         name="my-bricks", solve=solve, estimate=estimate,
    ...         fitted_spacing=lambda planned, spacing, memory_bytes: spacing,
    ...         elements_per_wall=lambda cell: 0.7, elements_per_layer=0.7,
    ...     )
    >>> [analysis.name for analysis in gradedesign_analyses()]
    ['my-bricks']
    """
    return ()
