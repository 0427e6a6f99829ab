"""Checks that the keys which kinds of limits and of components add to a case file are free."""

from __future__ import annotations

from collections.abc import Mapping

from gradedesign.common.values.table import Table
from gradedesign.design.resolve.registry import PluginSource
from gradedesign.errors import PluginError
from gradedesign.geometry.lattice.component_kind import ComponentKind
from gradedesign.mechanics.limits.limit import LimitKind


def check_keys(
    kinds: Mapping[str, tuple[LimitKind | ComponentKind, PluginSource]],
    table: type[Table],
    section: str,
    noun: str,
) -> None:
    """Refuse a kind whose list would take the place of a key of the core.

    Parameters
    ----------
    kinds : mapping of name to (kind, PluginSource)
    table : type of Table
        To which the lists are added.
    section, noun : str
        Name of that table, and of such a kind.

    Raises
    ------
    PluginError
    """
    own = {field.alias or name for name, field in table.model_fields.items()}
    for name, (kind, source) in kinds.items():
        if kind.entry is not None and name in own | set(dir(table)):
            raise PluginError(
                f"{noun} '{name}' of {source} adds a key that [{section}] has already; rename it, "
                f"for example to 'my_{name}'"
            )
