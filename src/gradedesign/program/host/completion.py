"""Names that a shell offers, read from tables and entry points, without a registry."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import metadata, resources
from typing import Any

from gradedesign.common.values.plugins_by_name import plugins_are_off, suppliers
from gradedesign.program.host.markers import GROUP

#: Files of the core whose headings are names; their packages, which load numpy, are not imported.
_HEADINGS = {
    "materials": "mechanics/material/materials.toml",
    "processes": "design/printing/processes.toml",
}


def completed(kind: str) -> Callable[[str], list[str]]:
    """Shell completion of an argument or option that takes a name, for typer's ``autocompletion``.

    Parameters
    ----------
    kind : str
        Of the names: ``cell_families``, ``materials``, ``processes`` or ``eigen_solvers``.

    Returns
    -------
    callable
        Takes what was typed and returns the installed names that begin with it, sorted. Plugins
        of this project are not loaded for it; another that cannot be loaded offers nothing.

    Examples
    --------
    >>> completed("materials")("Ti-")
    ['Ti-6Al-4V']
    """

    def names(incomplete: str) -> list[str]:
        found = {*_of_the_core(kind), *_of_plugins(kind)}
        return sorted(name for name in found if name.startswith(incomplete))

    return names


def _of_the_core(kind: str) -> Iterable[str]:
    if kind not in _HEADINGS:
        return ()
    import tomllib

    text = resources.files("gradedesign").joinpath(_HEADINGS[kind]).read_text("utf-8")
    return tomllib.loads(text)


def _of_plugins(kind: str) -> Iterable[str]:
    if plugins_are_off():
        return
    ours = suppliers(kind)
    for point in metadata.entry_points(group=GROUP):
        source = point.dist.name if point.dist else ""
        if source in ours:
            yield from ours[source]
        elif source != "gradedesign":
            yield from _by_its_hook(point, kind)


def _by_its_hook(point: metadata.EntryPoint, kind: str) -> Iterable[str]:
    """Names that a plugin registers which no table of ours knows."""
    try:
        records: Iterable[Any] = getattr(point.load(), f"{GROUP}_{kind}", tuple)()
        return [str(record.name) for record in records]
    except Exception:  # noqa: BLE001 - foreign code may raise anything, and the user is typing
        return ()
