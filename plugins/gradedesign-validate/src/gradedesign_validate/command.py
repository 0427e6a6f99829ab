"""``gradedesign validate`` as typed: arguments and options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def validate(
    folders: Annotated[list[Path] | None, typer.Argument(help="Case folders [cases].")] = None,
    keyword: Annotated[
        str, typer.Option("-k", help="Only cases whose name contains this (or, and, not allowed).")
    ] = "",
    update: Annotated[
        bool, typer.Option("--update", help="Write new values of runs to expected.toml.")
    ] = False,
    junit: Annotated[
        Path | None, typer.Option("--junit", help="Write the comparisons as JUnit XML too.")
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", min=1, help="Cases at a time, each in its own process [in this]."),
    ] = None,
    history: Annotated[
        Path | None,
        typer.Option("--history", help="Append a line of each case, and tell what moved."),
    ] = None,
    changed: Annotated[
        bool,
        typer.Option("--changed", help="Only cases that, or whose program, changed since passing."),
    ] = False,
    strict_plugins: Annotated[
        bool, typer.Option("--strict-plugins", help="Stop if an installed plugin fails to load.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print plain data for another program.")
    ] = False,
) -> None:
    """Run case folders and compare with their expected.toml; exit code 1 if one deviates."""
    from gradedesign_validate.run_validate import ValidateRequest
    from gradedesign_validate.run_validate import validate as command

    if changed and history is None:
        raise typer.BadParameter("--changed needs --history FILE, which says what passed")
    request = ValidateRequest(
        keyword=keyword,
        update=update,
        strict_plugins=strict_plugins,
        as_json=as_json,
        junit=junit,
        jobs=jobs,
        history=history,
        changed=changed,
    )
    raise typer.Exit(command(folders, request))
