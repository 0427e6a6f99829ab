"""``gradedesign generate``: the lattice alone, from a stated density."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import typer

from gradedesign.design.case.read_generate import load_generate_case
from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import UNMET
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.run import holds_only_a_failure, print_result_json
from gradedesign.program.commands.show import (
    print_files,
    print_limits,
    print_table,
    print_text,
    print_warnings,
    without_noise,
)
from gradedesign.program.generate.generate import generate as generate_lattice
from gradedesign.program.host.read_case import entries_of
from gradedesign.program.store.stages import default_folder


def generate(
    path: Path,
    output: Path | None,
    *,
    overwrite: bool,
    allow_outside: bool,
    strict_plugins: bool,
    as_json: bool,
    on_loaded: Callable[[], None],
) -> int:
    """Make a lattice, print its densities and where the files are, return the exit code.

    ``on_loaded`` is called when nothing is left to load, before anything is printed.
    """
    registry = registry_for(strict_plugins=strict_plugins)
    case = load_generate_case(
        path, allow_outside=allow_outside, entries=lambda: entries_of(registry)
    )
    folder = default_folder(case) if output is None else output
    on_loaded()
    with ProgressLines(err=as_json, events=not as_json) as progress:
        result = generate_lattice(
            case,
            registry,
            folder=folder,
            overwrite=overwrite or holds_only_a_failure(folder),
            on_event=progress,
        )
    if as_json:
        print_result_json(result)
    else:
        print_generated(result)
    return UNMET if result.status == "not_met" else 0


def print_generated(result: RunResult) -> None:
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
