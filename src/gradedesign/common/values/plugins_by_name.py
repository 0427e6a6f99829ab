"""Plugins of this project that supply a name which nothing installed supplies."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import metadata, resources

#: Set to 1 to load no installed plugin, only the built-ins.
DISABLE_VARIABLE = "GRADEDESIGN_DISABLE_PLUGINS"


def plugins_are_off() -> bool:
    """Whether the user wants no installed plugin."""
    return os.environ.get(DISABLE_VARIABLE, "") not in ("", "0")


def supplied_by(kind: str, name: str) -> str:
    """Words on the plugin that a name needs; empty where no plugin of this project supplies it.

    Parameters
    ----------
    kind : str
        ``commands``, ``cell_families``, ``cell_makers``, ``exporters``, ``outputs``, ``repairers``,
        ``solvers``, ``suffixes`` of part files, or ``keys`` of a case file, dotted.
    name : str
        Nothing that is loaded supplies it.

    Examples
    --------
    >>> supplied_by("cell_families", "no-cell-of-this-project")
    ''
    """
    for plugin, names in _plugins().get(kind, {}).items():
        if name in names:
            try:
                metadata.version(plugin)
            except metadata.PackageNotFoundError:
                return f"install the plugin {plugin}"
            set_to = f": {DISABLE_VARIABLE} is set" if os.environ.get(DISABLE_VARIABLE) else ""
            return f"its plugin {plugin} is installed but not loaded{set_to}"
    return ""


def suppliers(kind: str) -> Mapping[str, Sequence[str]]:
    """Names of a kind by plugin, of every plugin of this project: empty where it has none."""
    every = {plugin for of in _plugins().values() for plugin in of}
    return {plugin: _plugins().get(kind, {}).get(plugin, ()) for plugin in every}


@cache
def _plugins() -> dict[str, dict[str, list[str]]]:
    import tomllib  # here, since `gradedesign --help` has nothing to look up

    text = resources.files(__package__).joinpath("plugins_by_name.toml").read_text("utf-8")
    return tomllib.loads(text)
