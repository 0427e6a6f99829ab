"""``gradedesign tabulate --finite-size``: how stiff few cells are, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gradedesign.cli.layout import say
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.progress_lines import ProgressLines
from gradedesign.cli.show import print_text
from gradedesign.cli.tabulate import make_folder
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.homogenise.finite_size_rows import finite_size_table
from gradedesign.material.finite_size_table import write_finite_size_table
from gradedesign.plugin.registry import lookup
from gradedesign.workspace.atomic import write_text
from gradedesign.workspace.progress import counted


def tabulate_finite_size(
    cells: Sequence[str],
    output: Path,
    poissons_ratio: float,
    others: Sequence[object],
    strict_plugins: bool,
) -> int:
    """Compute the finite size tables of cells, one after the other, to ``<cell>.json``.

    Parameters
    ----------
    cells : sequence of str
        At least one.
    output : Path
        Folder; made where missing. Earlier tables are replaced.
    poissons_ratio : float
    others : sequence
        Options that only property tables have; all None.
    strict_plugins : bool

    Returns
    -------
    int
        Exit code: 0, or that of the last cell that failed; the others are written.

    Raises
    ------
    CaseError
        Without a cell, for an unknown one, other options, or a folder that cannot be made.
    """
    if any(other is not None for other in others):
        raise CaseError(
            "--finite-size has its own grids and one process; leave out --resolution, --workers, "
            "--scheduler and --buckling"
        )
    registry = registry_for(strict_plugins=strict_plugins)
    names = list(dict.fromkeys(cells))
    if not names:
        raise CaseError(
            "--finite-size takes one to several minutes for each cell; name the cells to compute"
        )
    families = [lookup(registry, "cell_families", name) for name in names]
    make_folder(output)
    code = 0
    with ProgressLines("tabulate", err=True):
        for family in counted(families, "cell", len(families)):
            try:
                table = finite_size_table(family, poissons_ratio=poissons_ratio)
            except GradeDesignError as error:
                say(f"{family.name}: {error}", err=True)
                code = error.exit_code
                continue
            path = output / f"{family.name}.json"
            write_text(path, write_finite_size_table(table))
            print_text(
                f"{family.name}: {len(table.rows)} densities from {table.density[0]:g} to "
                f"{table.density[-1]:g}; wrote {path}",
                hang=2,
            )
    return code
