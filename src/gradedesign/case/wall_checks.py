"""Walls that the printer of a case cannot make."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign.case.lattice_schema import CellsSpec
from gradedesign.case.print_schema import PrintSpec
from gradedesign.case.problems import Problem

#: Thinnest wall, mm, of the coarsest printers, which lay beads of concrete or weld metal.
MOST_LEAST_WALL = 50.0


def feather_problems(spec: PrintSpec | None) -> Iterator[Problem]:
    """Find a limit on feather edges without the wall that they are thinner than.

    Yields
    ------
    Problem
    """
    if spec is not None and spec.min_wall is None and spec.limits.feather_edges is not None:
        yield Problem(
            key=("print", "limits", "feather_edges"),
            message=f"found {spec.limits.feather_edges:g} without [print] min_wall; expected the "
            'thinnest wall that the printer makes beside it, such as min_wall = "0.4 mm"',
        )


def wall_problems(lattice: CellsSpec, spec: PrintSpec | None) -> Iterator[Problem]:
    """Find cells and walls too small for the thinnest wall of a printer, or one that none has.

    Yields
    ------
    Problem
    """
    least = None if spec is None else spec.min_wall
    if least is None:
        return
    size, wall = lattice.cell_size, lattice.wall
    if least > MOST_LEAST_WALL:
        yield Problem(
            key=("print", "min_wall"),
            message=f"found {least:g} mm; expected the thinnest wall that the printer makes, "
            f"{MOST_LEAST_WALL:g} mm at most; is its unit right?",
        )
        return
    if size < 2 * least:
        yield Problem(
            key=("lattice", "size"),
            message=f"found {size:g} mm, less than twice the min_wall of {least:g} mm; "
            f"expected at least {2 * least:g} mm",
        )
    if wall is not None and wall < least:
        yield Problem(
            key=("lattice", "wall"),
            message=f"found {wall:g} mm, thinner than the min_wall of {least:g} mm; "
            f"expected at least that",
        )
