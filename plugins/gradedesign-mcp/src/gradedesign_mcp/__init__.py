"""``gradedesign mcp``: gradedesign for assistants that speak the Model Context Protocol."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import Command, hookimpl
from gradedesign_mcp.command import mcp

__all__ = ["gradedesign_commands"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``gradedesign mcp``."""
    yield Command(name="mcp", call=mcp)
