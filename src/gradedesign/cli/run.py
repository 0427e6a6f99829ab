"""``gradedesign run``."""

from __future__ import annotations

from pathlib import Path

import typer

from gradedesign.case.read_case import load_case
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.show import ProgressLines, limit_columns, print_json, print_table
from gradedesign.ladder.files import RESULT_NAME
from gradedesign.ladder.result import RunResult, as_json
from gradedesign.ladder.stages import default_folder
from gradedesign.output.limit_notes import scope_words
from gradedesign.pipeline import run as run_case
from gradedesign.workspace.atomic import is_folder
from gradedesign.workspace.manifest import read_manifest
from gradedesign.workspace.progress import ignore
from gradedesign.workspace.run_folder import STAGES

#: Statuses that are results but not successes, and their exit code.
UNMET = 4


def run(
    path: Path,
    output: Path | None,
    *,
    resume: bool,
    overwrite: bool,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
) -> int:
    """Run a case, print its verdict and return the exit code."""
    case = load_case(path, allow_outside=allow_outside)
    registry = registry_for(strict_plugins=strict_plugins)
    folder = default_folder(case) if output is None else output
    result = run_case(
        case,
        registry,
        folder=folder,
        resume=resume,
        overwrite=overwrite or (not resume and holds_only_a_failure(folder)),
        on_event=ignore if as_json else ProgressLines(),
    )
    if as_json:
        print_result_json(result)
    else:
        print_verdict(result)
    return UNMET if result.status in ("not_met", "infeasible") else 0


def holds_only_a_failure(folder: Path) -> bool:
    """Whether a run folder holds nothing but the message of a run that failed at once."""
    if not is_folder(folder) or any((folder / STAGES).glob("*.npz")):
        return False
    manifest = read_manifest(folder)
    result = folder / RESULT_NAME
    if manifest is None or set(manifest.artefacts) != {RESULT_NAME} or not result.is_file():
        return False
    return '"status": "failed"' in result.read_text(encoding="utf-8")


def print_result_json(result: RunResult) -> None:
    """Print what result.json holds."""
    print_json(as_json(result))


def print_verdict(result: RunResult) -> None:
    """Print the verdict, the limits and where the files are."""
    typer.echo("")
    typer.echo(f"{result.status.upper()}{', lightest' if result.lightest else ''}: {result.reason}")
    if result.limits:
        print_table("Limits", *limit_columns(result.limits))
    if result.mass_g is not None and result.solid_mass_g and result.relative_density is not None:
        lattice = (
            ""
            if result.lattice_mass_g is None
            else f", lattice {result.lattice_mass_g:.4g} g at mean density "
            f"{result.lattice_density:.3f}"
        )
        typer.echo(
            f"mass {result.mass_g:.4g} g of {result.solid_mass_g:.4g} g solid "
            f"({result.relative_density:.1%}){lattice}"
        )
    if result.acceptance:
        typer.echo(scope_words(result.acceptance))
    for warning in result.warnings:
        typer.echo(f"warning: {warning}")
    names = sorted(set(result.files.values()))
    typer.echo(f"files in {result.folder}: {', '.join(names)}")
