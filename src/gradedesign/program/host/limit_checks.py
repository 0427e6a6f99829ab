"""Checks that the keys which kinds of limits add to a case file are free."""

from __future__ import annotations

from collections.abc import Mapping

from gradedesign.design.resolve.registry import PluginSource
from gradedesign.errors import PluginError
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.mechanics.limits.limits_schema import LimitsSpec


def check_limit_keys(kinds: Mapping[str, tuple[LimitKind, PluginSource]]) -> None:
    """Refuse a kind whose list of limits would take the place of a key of the core.

    Raises
    ------
    PluginError
    """
    taken = {field.alias or name for name, field in LimitsSpec.model_fields.items()}
    for name, (kind, source) in kinds.items():
        if kind.entry is not None and name in taken | set(dir(LimitsSpec)):
            raise PluginError(
                f"kind of limit '{name}' of {source} adds a key that [limits] has already; "
                f"rename it, for example to 'my_{name}'"
            )
