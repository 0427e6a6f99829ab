"""Judge a design: export its surface, read it back, mesh it again whole or in windows, analyse."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.errors import LatticeError
from gradedesign.lattice.islands import Islands, remove_islands
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.limits.limit import Limit
from gradedesign.limits.row import LimitRow
from gradedesign.limits.verdict import (
    Factors,
    all_hold,
    learned_factors,
    limit_rows,
    scaled_rows,
)
from gradedesign.loop.announce import Announcer
from gradedesign.loop.rounds import Analysed, Round
from gradedesign.loop.second_size import SecondSize, analyse_second_size, with_resolution
from gradedesign.mesh.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.output.stl import write_stl
from gradedesign.part.repair import build_surface
from gradedesign.part.stl import read_stl
from gradedesign.resolve.lattice_files import STL_NAME
from gradedesign.resolve.setup import Setup
from gradedesign.verify.acceptance import (
    Acceptance,
    accept_whole,
    accept_windows,
    choose_scope,
)
from gradedesign.verify.submodel import SubmodelResult
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder

#: Grid of the exported surface over the surface size of the explicit analysis.
SURFACE_PER_SPACING = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accepted:
    """Design with the result of its acceptance.

    Attributes
    ----------
    round : Round
    analysed : Analysed
        Explicit analysis that judged it.
    surface : SurfaceMesh
        As read back from the exported file.
    islands : Islands
    acceptance : Acceptance
    second : SecondSize
        The same design on another grid.
    rows : tuple of LimitRow
        The values that decide.
    factors : dict of LimitKey to float
        Accepted over explicit values.
    holds : bool
    """

    round: Round
    analysed: Analysed
    surface: SurfaceMesh
    islands: Islands
    acceptance: Acceptance
    second: SecondSize
    rows: tuple[LimitRow, ...]
    factors: Factors
    holds: bool


def accept_design(
    setup: Setup,
    out: RunFolder,
    done: Round,
    analysed: Analysed,
    announce: Announcer,
) -> Accepted:
    """Export the surface of a design and have it accepted or refused.

    With scope "whole" an independent mesh of the surface judges every limit. With "windows" the
    explicit analysis does, those limits that windows can judge times their ratio.
    """
    surface, islands = export_surface(setup, out, analysed)
    began = time.perf_counter()
    second = analyse_second_size(setup, done, analysed)
    announce.took("second mesh", time.perf_counter() - began)
    # Stated budgets alone decide what is judged and how: never the time that is left.
    budget, requested = setup.problem.case.run.time, setup.problem.case.run.acceptance
    scope = choose_scope(requested, analysed.result.solved.division.surface_tets, budget)
    if scope == "whole":
        acceptance = accept_whole(surface, analysed.solid, analysed.result, time_limit_s=budget)
        rows, factors = _whole_rows(setup, done, acceptance)
    else:
        acceptance = accept_windows(
            surface,
            analysed.solid,
            analysed.result,
            time_limit_s=budget,
            on_window=announce.window,
        )
        factors = window_factors(setup.problem.limits, acceptance.windows)
        rows = scaled_rows(
            done.rows,
            factors,
            f"explicit analysis times the ratio of {len(acceptance.windows)} windows",
        )
    rows = with_resolution(rows, done.rows, second.rows)
    return Accepted(
        round=done,
        analysed=analysed,
        surface=surface,
        islands=islands,
        acceptance=acceptance,
        second=second,
        rows=rows,
        factors=factors,
        holds=all_hold(rows),
    )


def export_surface(setup: Setup, out: RunFolder, analysed: Analysed) -> tuple[SurfaceMesh, Islands]:
    """Extract the surface, drop islands, write the STL file and read it back.

    Raises
    ------
    LatticeError
        If the file's volume differs from the analysed solid's by more than 5 %.
    """
    design, problem = analysed.design, setup.problem
    size = analysed.result.solved.division.surface_size
    step = SURFACE_PER_SPACING * size
    raw = trimmed_surface(design, problem.part.surface, step)
    report_step("disconnected components of the surface")
    surface, islands = remove_islands(
        raw, keep=setup.problem.domain.bodies, least_pocket=(0.5 * step) ** 3
    )
    report_step("writing and reading back the surface")
    path = out.path_of(STL_NAME)
    write_stl(path, surface)
    out.adopt(STL_NAME)
    triangles = read_stl(path)
    back, _ = build_surface(triangles.corners, repair="safe", bodies=problem.case.part.bodies)
    volume, meshed = enclosed_volume(back), analysed.result.volume
    if not np.isclose(volume, meshed, rtol=0.05):
        raise LatticeError(
            f"the exported surface encloses {volume:.6g} mm^3 but the explicit analysis holds "
            f"{meshed:.6g} mm^3; the explicit grid of {size:.3g} mm is too coarse "
            f"for {setup.cells.cell.name}: raise [run] elements_per_wall"
        )
    return back, islands


def _whole_rows(
    setup: Setup, done: Round, acceptance: Acceptance
) -> tuple[tuple[LimitRow, ...], Factors]:
    """Rows judged by the re-meshed whole lattice, and their ratios to the explicit values."""
    whole = acceptance.whole
    if whole is None:
        raise LatticeError("acceptance of the whole lattice returned no analysis")
    rows = limit_rows(setup.problem.limits, whole, "re-meshed whole lattice")
    factors = learned_factors(done.rows, rows)
    return (*rows, *(row for row in done.rows if row.homogenised)), factors


def window_factors(limits: Sequence[Limit], windows: Sequence[SubmodelResult]) -> Factors:
    """Accepted over explicit value of every limit that windows can judge."""
    found = {limit.key: limit.window_factor(windows) for limit in limits}
    return {key: factor for key, factor in found.items() if factor is not None}
