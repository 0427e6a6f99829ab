"""The server: tools of one folder on standard input and output, and what it starts ends with it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mcp.server.mcpserver import MCPServer
from mcp.types import ToolAnnotations

from gradedesign import CaseError
from gradedesign_mcp.bounds import Bounds
from gradedesign_mcp.runs import Runs
from gradedesign_mcp.tools import Tools

_INSTRUCTIONS = """\
gradedesign finds the lightest printable lattice body of a part that still meets its limits, and \
proves it by an analysis of the printed surface. All paths are relative to one folder. An option \
that a message names, such as --units, is the parameter of that name.

1. inspect_part, then propose_case: a case file with the part's faces as regions, and "?" for what \
only the user knows. Never invent loads, supports, material or limits: ask for them.
2. write_case with the answers; check_case until it names no mistake; show_picture of its picture \
lets the user see loads and supports. estimate_masses tells what to expect.
3. start_run, follow_run until it has ended, read_verdict. Only `status` "met" means that every \
limit holds; tell the user each limit, its value and its band, and the warnings.
4. A body that another program made or the user changed: judge_body, by the limits of a case.
5. show_scene writes a page that the user opens in the browser.
"""


def serve(folder: Path, *, runs: int) -> None:
    """Answer an assistant until it closes standard input.

    Raises CaseError if there is no such folder.

    Parameters
    ----------
    folder : Path
        Nothing outside it is read for a client or written.
    runs : int
        At a time.
    """
    if not folder.is_dir():
        raise CaseError(f"{folder} is not a folder; expected the one with parts and cases")
    bounds = Bounds(root=folder.resolve())
    make_server(Tools(bounds=bounds), Runs(bounds=bounds, most=runs)).run("stdio")


def make_server(tools: Tools, runs: Runs) -> MCPServer[None]:
    """A server of these tools; it ends the runs that they have started."""

    @asynccontextmanager
    async def lifespan(_: MCPServer[None]) -> AsyncIterator[None]:
        try:
            yield
        finally:
            runs.close()

    server = MCPServer(
        "gradedesign",
        instructions=_INSTRUCTIONS,
        version=version("gradedesign-mcp"),
        log_level="ERROR",
        lifespan=lifespan,
    )
    looks: tuple[Callable[..., Any], ...] = (
        tools.inspect_part, tools.read_case, tools.judge_body, runs.follow_run,
        runs.read_verdict, tools.show_picture, tools.list_installed,
    )  # fmt: skip
    adds = (tools.propose_case, tools.check_case, tools.estimate_masses, tools.show_scene)
    replaces = (tools.write_case, runs.start_run, runs.stop_run)
    for group, read_only, destructive in (
        (looks, True, False), (adds, False, False), (replaces, False, True),
    ):  # fmt: skip
        for tool in group:
            server.add_tool(
                tool,
                annotations=ToolAnnotations(
                    read_only_hint=read_only,
                    destructive_hint=destructive,
                    open_world_hint=False,
                ),
            )
    return server
