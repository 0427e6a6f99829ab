"""Plugins of this project that supply a name which nothing installed supplies."""

from __future__ import annotations

import os
import tomllib
from functools import cache
from importlib import metadata, resources

#: Set to 1 to load no installed plugin, only the built-ins.
DISABLE_VARIABLE = "GRADEDESIGN_DISABLE_PLUGINS"


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


@cache
def _plugins() -> dict[str, dict[str, list[str]]]:
    text = resources.files(__package__).joinpath("plugins_by_name.toml").read_text("utf-8")
    return tomllib.loads(text)
