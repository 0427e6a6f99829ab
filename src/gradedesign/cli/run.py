"""``gradedesign run``."""

from __future__ import annotations

from pathlib import Path

import typer

from gradedesign.case.read_case import load_case
from gradedesign.case.schema import Case
from gradedesign.cli.show import ProgressLines, print_json, print_table
from gradedesign.ladder.result import RunResult, as_json
from gradedesign.pipeline import run as run_case
from gradedesign.workspace.progress import ignore

#: Statuses that are results but not successes, and their exit code.
UNMET = 4


def read(path: Path, *, allow_outside: bool) -> Case:
    """Read a case file, or the ``case.toml`` of a folder."""
    file = path / "case.toml" if path.is_dir() else path
    return load_case(file, allow_outside=allow_outside)


def run(
    path: Path,
    output: Path | None,
    *,
    resume: bool,
    overwrite: bool,
    allow_outside: bool,
    as_json: bool,
) -> int:
    """Run a case, print its verdict and return the exit code."""
    case = read(path, allow_outside=allow_outside)
    result = run_case(
        case,
        folder=output,
        resume=resume,
        overwrite=overwrite,
        on_event=ignore if as_json else ProgressLines(),
    )
    if as_json:
        print_result_json(result)
    else:
        print_verdict(result)
    return UNMET if result.status in ("not_met", "infeasible") else 0


def print_result_json(result: RunResult) -> None:
    """Print what result.json holds."""
    print_json(as_json(result))


def print_verdict(result: RunResult) -> None:
    """Print the verdict, the limits and where the files are."""
    typer.echo("")
    typer.echo(f"{result.status.upper()}{', lightest' if result.lightest else ''}: {result.reason}")
    if result.limits:
        rows = [
            (
                row.name,
                row.load_case,
                f"{row.value:.4g} {row.unit}",
                f"{row.limit:.4g} {row.unit}",
                f"{1 - row.use:+.1%}",
                "-" if row.resolution_error is None else f"{row.resolution_error:+.1%}",
                row.judged_by,
            )
            for row in result.limits
        ]
        columns = ("limit", "load case", "value", "allowed", "margin", "coarser mesh", "judged by")
        print_table("Limits", columns, rows)
    if result.mass_g is not None and result.solid_mass_g:
        typer.echo(
            f"mass {result.mass_g:.4g} g of {result.solid_mass_g:.4g} g solid "
            f"({result.relative_density:.1%}), lattice {result.lattice_mass_g:.4g} g at mean "
            f"density {result.lattice_density:.3f}"
        )
    for warning in result.warnings:
        typer.echo(f"warning: {warning}")
    typer.echo(f"files in {result.folder}: " + ", ".join(sorted(set(result.files.values()))))
