"""``gradedesign run``."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import typer

from gradedesign.common.system.atomic import is_folder
from gradedesign.design.verdict.result import RunResult, as_json, scope_words, symmetry_words
from gradedesign.errors import UNMET
from gradedesign.pipeline import run as run_case
from gradedesign.program.commands.compiled_ahead import compiling_ahead
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import (
    print_as_built,
    print_files,
    print_json,
    print_limits,
    print_table,
    print_text,
    print_warnings,
    without_noise,
)
from gradedesign.program.commands.show_answer import print_bodies
from gradedesign.program.host.read_case import load_case
from gradedesign.program.outputs.files import RESULT_NAME
from gradedesign.program.store.manifest import read_manifest
from gradedesign.program.store.run_folder import STAGES
from gradedesign.program.store.stages import default_folder


def run(
    path: Path,
    output: Path | None,
    *,
    resume: bool,
    overwrite: bool,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
    on_loaded: Callable[[], None],
) -> int:
    """Run a case, print its verdict and return the exit code.

    ``on_loaded`` is called when nothing is left to load, before anything is printed.
    """
    registry = registry_for(strict_plugins=strict_plugins)
    case = load_case(path, allow_outside=allow_outside, registry=registry)
    folder = default_folder(case.name) if output is None else output
    on_loaded()
    lines = ProgressLines(budget_s=case.run.time, err=as_json, events=not as_json)
    # A stated lattice is not analysed.
    with lines as progress, nullcontext() if case.lattice.stated else compiling_ahead():
        result = run_case(
            case,
            registry,
            folder=folder,
            resume=resume,
            overwrite=overwrite or (not resume and holds_only_a_failure(folder)),
            on_event=progress,
        )
    if as_json:
        _print_result_json(result)
    elif case.lattice.stated:
        _print_stated(result)
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


def _print_result_json(result: RunResult) -> None:
    """Print what result.json holds."""
    print_json(as_json(result))


def _print_stated(result: RunResult) -> None:
    """Print target and achieved density of every slab along the axis on which they differ most."""
    density = result.measures["density"]
    measured_on = "surface" if "surface" in density else "layers"
    axis, slabs = max(
        density["slabs"].items(), key=lambda item: max(item[1]["target"]) - min(item[1]["target"])
    )
    edges = without_noise(slabs["edges_mm"], max(map(abs, slabs["edges_mm"])))
    rows = [
        (f"{low:.4g} to {high:.4g}", f"{t:.4f}", f"{f:.4f}", f"{s:.4f}", f"{s - t:+.4f}")
        for low, high, t, f, s in zip(
            edges,
            edges[1:],
            slabs["target"],
            slabs["field"],
            slabs[measured_on],
            strict=False,
        )
    ]
    typer.echo("")
    print_table(
        "Relative density by slabs of one cell",
        (f"{axis} mm", "target", "field", measured_on, "error"),
        rows,
    )
    print_text(
        f"total: target {density['target']:.4f}, field {density['field']:.4f}, {measured_on} "
        f"{density[measured_on]:.4f}; thinnest wall "
        f"{result.measures['cell']['thinnest_wall_mm']:.3g} mm",
        hang=2,
    )
    if result.mass_g is not None:
        print_text(f"mass {result.mass_g:.4g} g of {result.solid_mass_g:.4g} g solid")
    print_as_built(result)
    if thin := result.printed.get("thickness_percentiles_mm"):
        print_text(
            f"thickness: 0.1, 1 and 5 % of the surface have less than {thin['0.1']:.3g}, "
            f"{thin['1']:.3g} and {thin['5']:.3g} mm of solid behind them",
            hang=2,
        )
    if result.status == "not_met":
        print_text(f"NOT_MET: {result.reason}", hang=2)
    if result.limits:
        print_limits(result.limits)
    print_warnings(result.warnings)
    print_files(result.folder, result.files.values())


def print_verdict(result: RunResult) -> None:
    """Print the verdict, the limits and where the files are."""
    typer.echo("")
    print_text(result.verdict, hang=2)
    print_warnings(result.yields)
    if result.limits:
        print_limits(result.limits)
    if result.mass_g is not None and result.solid_mass_g and result.relative_density is not None:
        lattice = (
            ""
            if not result.lattice_mass_g
            else f", lattice {result.lattice_mass_g:.4g} g at mean density "
            f"{result.lattice_density:.3f}"
        )
        print_text(
            f"mass {result.mass_g:.4g} g of {result.solid_mass_g:.4g} g solid "
            f"({result.relative_density:.1%}){lattice}",
            hang=2,
        )
    print_as_built(result)
    print_bodies(
        result.bodies,
        result.why_lattice,
        accepted_g=result.mass_g if result.status == "met" else None,
    )
    if result.symmetry:
        print_text(symmetry_words(result), hang=2)
    if result.acceptance:
        print_text(scope_words(result.acceptance), hang=2)
    print_warnings(told for told in result.warnings if told not in result.yields)
    if result.files:
        print_files(result.folder, result.files.values())
