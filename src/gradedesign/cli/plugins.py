"""The registry as the commands build it: a plugin that is disabled is told."""

from __future__ import annotations

import typer

from gradedesign.plugin.registry import Registry, build_registry


def registry_for(*, strict_plugins: bool) -> Registry:
    """Build the registry of the installed plugins and name every one that failed to load.

    Raises
    ------
    PluginError
        With ``strict_plugins``, for one that failed to load.
    """
    registry = build_registry(strict=strict_plugins)
    for failure in registry.failures:
        typer.echo(f"warning: disabled {failure}", err=True)
    return registry
