"""Mesh-convergence check: the final design at a second grid spacing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gradedesign.errors import LatticeError, MeshError, ResourceError
from gradedesign.limits.row import LimitRow
from gradedesign.limits.verdict import limit_rows
from gradedesign.loop.rounds import Analysed, Round, analyse_design
from gradedesign.resolve.setup import Setup
from gradedesign.workspace.progress import stepping

#: Second mesh sizes over the first, in the order in which they are tried. A coarser grid costs
#: half; where it loses walls, a finer one tells as much for twice the time.
SECOND_SIZES = (1.25, 0.8)
#: A value that changes by more from one grid to the other is not resolved.
UNRESOLVED = 0.10


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondSize:
    """Explicit values of the same design on another grid.

    Attributes
    ----------
    mesh_size : float or None, mm
        None where no second grid could be analysed.
    rows : tuple of LimitRow
    refused : tuple of str
        Why grids that were tried first were refused.
    """

    mesh_size: float | None
    rows: tuple[LimitRow, ...]
    refused: tuple[str, ...] = ()


def analyse_second_size(setup: Setup, done: Round, analysed: Analysed) -> SecondSize:
    """Analyse a round's design again on the first of `SECOND_SIZES` that passes its gates.

    A grid that loses pieces or volume, or that the memory does not hold, is named in
    ``refused``; without any second grid the verdict says that its resolution error is unknown.
    """
    refused: list[str] = []
    for factor in SECOND_SIZES:
        try:
            with stepping("second mesh"):
                second = analyse_design(setup, done.rho, spacing=factor * analysed.result.mesh_size)
        except (LatticeError, MeshError, ResourceError) as error:
            size = factor * analysed.result.mesh_size
            refused.append(f"a second mesh of {size:.3g} mm was refused: {error}")
            continue
        rows = limit_rows(setup.problem.limits, second.result, "second")
        return SecondSize(mesh_size=second.result.mesh_size, rows=rows, refused=tuple(refused))
    return SecondSize(mesh_size=None, rows=(), refused=tuple(refused))


def with_resolution(
    rows: Sequence[LimitRow], first: Sequence[LimitRow], second: Sequence[LimitRow]
) -> tuple[LimitRow, ...]:
    """Accepted rows with the change of the explicit value from the first grid to the second."""
    before, after = ({row.key: row.value for row in one} for one in (first, second))
    out = []
    for row in rows:
        old, new = before.get(row.key), after.get(row.key)
        error = None if not old or new is None else new / old - 1.0
        out.append(replace(row, resolution_error=error))
    return tuple(out)


def unresolved_warnings(rows: Sequence[LimitRow]) -> tuple[str, ...]:
    """Say which values change by more than `UNRESOLVED` on the second mesh."""
    return tuple(
        f"{row.name} ({row.load_case}) changes by {row.resolution_error:+.0%} on the second mesh: "
        f"this value is not resolved, and the verdict on it may be wrong; state a larger [run] "
        f"elements_per_wall with more memory"
        for row in rows
        if row.resolution_error is not None and abs(row.resolution_error) > UNRESOLVED
    )
