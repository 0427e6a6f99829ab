"""The registry as the commands build it; faults of plugins are printed."""

from __future__ import annotations

import typer

from gradedesign.design.resolve.registry import Registry
from gradedesign.program.host.registry import build_registry


def registry_for(*, strict_plugins: bool) -> Registry:
    """Build the registry of the installed plugins and print what is wrong with them.

    Raises
    ------
    PluginError
        With ``strict_plugins``, for one that failed to load or has a hook without its marker.
    """
    registry = build_registry(strict=strict_plugins)
    for note in registry.notes:
        typer.echo(f"warning: {note}", err=True)
    return registry
