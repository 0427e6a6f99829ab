"""Functions with the name of a hook that nothing marks as one, and that are never called."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pluggy

from gradedesign.design.resolve.registry import PluginSource
from gradedesign.program.host import hookspecs


def hook_names() -> list[str]:
    """Names of every hook."""
    return [name for name in vars(hookspecs) if name.startswith("gradedesign_")]


def unmarked_hooks(
    manager: pluggy.PluginManager, sources: Mapping[str, PluginSource]
) -> Iterator[str]:
    """One sentence for every function that is named like a hook and lacks the marker.

    Parameters
    ----------
    sources : mapping of str to PluginSource
        By the name under which a plugin is registered.
    """
    for name, source in sorted(sources.items()):
        for hook in hook_names():
            function = getattr(manager.get_plugin(name), hook, None)
            if callable(function) and not hasattr(function, f"{hookspecs.GROUP}_impl"):
                yield (
                    f"function {hook} of plugin '{source.entry_point}' ({source}) is never called: "
                    f"it lacks @hookimpl, from gradedesign import hookimpl"
                )
