"""``gradedesign mcp`` as typed: its folder and its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def mcp(
    folder: Annotated[
        Path | None,
        typer.Argument(help="The folder with parts, cases and runs; nothing outside it [.]."),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", min=1, help="Runs at a time.")] = 1,
) -> None:
    """Serve parts, cases and runs of a folder to an assistant, on standard input and output."""
    from gradedesign_mcp.server import serve

    serve(Path() if folder is None else folder, runs=runs)
