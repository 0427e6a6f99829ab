"""The commands: the only place that prints, catches broadly or exits."""

from __future__ import annotations

from gradedesign.cli.app import main

__all__ = ["main"]
