"""Tables that a distribution of cells ships as plain data beside its code."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import resources

from gradedesign.mechanics.material.property_table import read_property_table
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.material.tabulated_law import tabulated_law


def shipped_laws(package: str) -> Iterator[ScalingLaw]:
    """Law of every property table in a package, by file name.

    Parameters
    ----------
    package : str
        Importable name of the folder that holds what ``gradedesign tabulate`` wrote.

    Raises
    ------
    PluginError
        If a table is damaged or of another format.
    ValueError
        If stiffness or strength of one do not grow with density.

    Examples
    --------
    >>> import gradedesign
    >>> @gradedesign.hookimpl
    ... def gradedesign_scaling_laws():
    ...     yield from gradedesign.shipped_laws("my_cells.properties")
    """
    yield from _laws(package)


@cache
def _laws(package: str) -> tuple[ScalingLaw, ...]:
    """The laws of a package, the same records at every call."""
    return tuple(tabulated_law(read_property_table(text)) for text in _tables(package))


def _tables(package: str) -> Iterator[str]:
    """Text of every JSON file in a package."""
    for entry in sorted(resources.files(package).iterdir(), key=lambda item: item.name):
        if entry.name.endswith(".json"):
            yield entry.read_text(encoding="utf-8")
