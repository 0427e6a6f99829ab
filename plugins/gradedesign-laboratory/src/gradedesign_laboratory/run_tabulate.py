"""``gradedesign tabulate``: property tables of cells, computed side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from gradedesign import CaseError, GradeDesignError, PropertyTable, read_property_table
from gradedesign.commands import (
    Cluster,
    ProgressLines,
    build_registry,
    counted,
    has_dask,
    named_cell,
    on_dask,
    print_text,
    registry_for,
    say,
    usable_cores,
    write_text,
)
from gradedesign.properties import (
    calibrate,
    compute_table,
    write_property_table,
)
from gradedesign_laboratory.buckling_tables import compute_buckling

#: Answer of a worker: a table's text, or the message and exit code of an error.
_Outcome = tuple[str | None, str, int]


def tabulate(
    cells: Sequence[str],
    output: Path,
    *,
    resolution: int | None,
    poissons_ratio: float,
    workers: int | None,
    scheduler: str | None,
    strict_plugins: bool,
    buckling: bool = False,
) -> int:
    """Compute the property tables of cells and write each to ``<cell>.json``.

    Parameters
    ----------
    cells : sequence of str
        Names, or cases whose cells are meant, see `named_cell`. None: all installed families.
    output : Path
        Folder; made where missing. Earlier tables are replaced; the critical stresses of one of the
        same cell are kept where no new ones are computed, since they have densities of their own.
    resolution : int or None
        Voxels along a cell; by default what each density's wall needs.
    workers : int or None
        Processes on this machine; by default one for each processor.
    scheduler : str or None
        Address of a running dask cluster, used instead.
    buckling : bool
        Compute critical stresses too, which takes minutes for each density.

    Returns
    -------
    int
        Exit code: 0, or that of the last cell that failed; the others are written.

    Raises
    ------
    CaseError
        For an unknown cell, a folder that cannot be made, or processes without dask.
    """
    registry = registry_for(strict_plugins=strict_plugins)
    names = list(dict.fromkeys(cells)) or sorted(registry.cell_families)
    families = {name: named_cell(registry, name).family.name for name in names}
    _make_folder(output)
    code = 0
    with ProgressLines("tabulate", err=True):
        for name, (text, message, failed) in _outcomes(
            names, resolution, poissons_ratio, workers, scheduler, buckling=buckling
        ):
            if text is None:
                say(f"{name}: {message}", err=True)
                code = failed
                continue
            path = output / f"{families[name]}.json"
            table = with_critical_stresses(read_property_table(text), path)
            write_text(path, write_property_table(table))
            print_text(
                f"{name}: {table.density.size} densities from {table.density[0]:g} to "
                f"{table.density[-1]:g}, stiffness to {table.stiffness_error.max():.1%}, strength "
                f"to {table.strength_error.max():.1%}{_buckling_text(table)}; wrote {path}",
                hang=2,
            )
    return code


def with_critical_stresses(table: PropertyTable, earlier: Path) -> PropertyTable:
    """Return a table with the critical stresses of the file that it replaces, unless it has some.

    Raises
    ------
    PluginError
        If that file is no table, or damaged.
    """
    if table.buckling is not None or not earlier.is_file():
        return table
    before = read_property_table(earlier.read_text(encoding="utf-8"))
    same = (before.family, dict(before.parameters)) == (table.family, dict(table.parameters))
    buckling = before.buckling if same else None
    if buckling is None or buckling.poissons_ratio != table.poissons_ratio:
        return table
    return replace(table, buckling=buckling)


def _make_folder(output: Path) -> None:
    """Make the folder of tables where it is missing.

    Raises
    ------
    CaseError
        If it cannot be made.
    """
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make folder {output}: {error.strerror}; name another one"
        ) from error


def _buckling_text(table: PropertyTable) -> str:
    """Densities and largest error of the critical stresses of a table; empty without them."""
    critical = table.buckling
    if critical is None:
        return ""
    return (
        f", buckling from {critical.density[0]:g} to {critical.density[-1]:g} "
        f"to {critical.error.max():.0%}"
    )


def _table_outcome(
    name: str, resolution: int | None, poissons_ratio: float, buckling: bool = False
) -> _Outcome:
    """Compute one table in whatever process this is; its plugins must be installed there."""
    try:
        named = named_cell(build_registry(), name)
        calibrated = calibrate(named.family, named.parameters)
        table = compute_table(calibrated, poissons_ratio=poissons_ratio, resolution=resolution)
        if buckling:
            # Each density's own resolution: that of stiffness would take hours.
            critical = compute_buckling(calibrated, poissons_ratio=poissons_ratio)
            table = replace(table, buckling=critical)
    except GradeDesignError as error:
        return None, str(error), error.exit_code
    return write_property_table(table), "", 0


def _outcomes(
    names: Sequence[str],
    resolution: int | None,
    poissons_ratio: float,
    workers: int | None,
    scheduler: str | None,
    *,
    buckling: bool,
) -> Iterator[tuple[str, _Outcome]]:
    """Outcome of each cell, as they come."""
    count = workers or (usable_cores() if has_dask() else 1)
    if scheduler is None and (count == 1 or len(names) == 1):
        for name in counted(names, "cell", len(names)):
            yield name, _table_outcome(name, resolution, poissons_ratio, buckling)
        return
    tasks = [(name, resolution, poissons_ratio, buckling) for name in names]
    cluster = Cluster(workers=min(count, len(names)), scheduler=scheduler)
    # One thread each: the tables beside it have the other processors.
    for task, future in on_dask(_table_outcome, tasks, cluster, text="cells beside each other"):
        yield task[0], future.result()
