"""``gradedesign sweep`` and ``gradedesign compare`` as typed: arguments and options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def sweep(
    study: Annotated[Path, typer.Argument(help="The study: a case and values of its keys.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; a sweep there goes on [runs/<study name>]."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", min=1, help="Processes; several need dask [by processors and memory]."
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a running dask cluster.")
    ] = None,
    allow_outside: Annotated[
        bool, typer.Option("--allow-outside", help="Let the case name files outside its folder.")
    ] = False,
    strict_plugins: Annotated[
        bool, typer.Option("--strict-plugins", help="Stop if an installed plugin fails to load.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print plain data for another program.")
    ] = False,
) -> None:
    """Run many designs of one case, into one table and one plot of mass against limits."""
    from gradedesign_sweep.run_sweep import SweepRequest
    from gradedesign_sweep.run_sweep import sweep as command

    request = SweepRequest(
        workers=workers,
        scheduler=scheduler,
        allow_outside=allow_outside,
        strict_plugins=strict_plugins,
        as_json=as_json,
    )
    raise typer.Exit(command(study, output, request))


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of finished runs, two or more.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Page to write (HTML).")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print plain data for another program.")
    ] = False,
) -> None:
    """Put finished runs side by side: masses, margins of limits, and their scenes in one page."""
    from gradedesign_sweep.compare_runs import compare as command

    command(runs, output, as_json=as_json)
