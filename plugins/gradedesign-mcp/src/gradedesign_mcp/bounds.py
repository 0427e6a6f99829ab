"""The folder that a server keeps to: paths that an assistant names, and paths that it is told."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

from mcp.server.mcpserver.exceptions import ToolError

CASE_FILE = "case.toml"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """A folder, absolute and without links."""

    root: Path

    def inside(self, text: str, what: str) -> Path:
        """The absolute path that an assistant names, free of links.

        Raises ToolError if it is absolute, holds ``..``, or leads out of the folder by a link.

        ``what``: the word for it in the message, such as ``part``.
        """
        # What is absolute, or has a drive, on Windows is refused everywhere.
        foreign = PureWindowsPath(text)
        if "\0" in text or not text.strip():
            raise ToolError(f"{what}: found {text!r}; expected a path below the server's folder")
        if foreign.drive or foreign.root:
            raise ToolError(
                f"{what}: {text!r} is absolute; expected a path relative to the server's folder, "
                f"such as 'bracket/case.toml'"
            )
        if ".." in foreign.parts:
            raise ToolError(
                f"{what}: {text!r} holds '..'; expected a path below the server's folder"
            )
        try:
            path = (self.root / text).resolve()
        except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
            raise ToolError(f"{what}: {text!r} cannot be followed ({error})") from None
        if not path.is_relative_to(self.root):
            raise ToolError(
                f"{what}: {text!r} leads out of the server's folder by a link; copy the file there"
            )
        return path

    def case(self, text: str) -> Path:
        """The file of a case that an assistant names, or names the folder of.

        Raises ToolError as `inside`.
        """
        path = self.inside(text, "case")
        return self.inside(f"{text}/{CASE_FILE}", "case") if path.is_dir() else path

    def told(self, data: Any) -> Any:
        """Plain data with every path in the folder relative to it."""
        if isinstance(data, dict):
            return {key: self.told(value) for key, value in data.items()}
        if isinstance(data, list):
            return [self.told(value) for value in data]
        if not isinstance(data, str):
            return data
        start = str(self.root)
        return "." if data == start else data.replace(f"{start}{os.sep}", "")


def name_of(path: Path) -> str:
    """The name of a case for files about it: that of its folder, or of a file of another name."""
    return path.parent.name if path.name == CASE_FILE else path.name if path.is_dir() else path.stem
