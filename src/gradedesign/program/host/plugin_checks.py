"""Checks across plugins: suffixes, names, keys that they add, functions without a marker."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import pluggy

from gradedesign.common.values.table import Table
from gradedesign.design.resolve.registry import PluginSource
from gradedesign.errors import PluginError
from gradedesign.geometry.lattice.component_kind import ComponentKind
from gradedesign.geometry.part.part_schema import OWN_REPAIRS, PartSpec
from gradedesign.geometry.part.reader import PartReader
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.program.host import hookspecs

_READ = re.compile(r"\.[a-z0-9_-]+")
_WRITTEN = re.compile(r"(\.[a-z0-9_-]+)+")

_Shelf = Mapping[str, tuple[Any, PluginSource]]


def check_formats(readers: _Shelf, exporters: _Shelf, outputs: _Shelf) -> None:
    """Check the suffixes of file formats.

    Raises PluginError for a suffix that is none, one that two readers take, a key of ``[part]``
    that is taken, or an exporter with the name of an output.

    ``readers``, ``exporters``, ``outputs``: record and source by name.
    """
    taken: dict[str, tuple[str, PluginSource]] = {}
    tables: dict[str, tuple[Any, PluginSource]] = {}
    for name, (reader, source) in sorted(readers.items()):
        if isinstance(reader.suffixes, str) or not reader.suffixes:
            raise PluginError(
                f"part reader '{name}' of {source} has suffixes {reader.suffixes!r}; expected a "
                f"tuple of them, such as ('.off',)"
            )
        _check_table(name, reader, source, tables)
        for suffix in reader.suffixes:
            if not isinstance(suffix, str) or not _READ.fullmatch(suffix):
                raise PluginError(
                    f"part reader '{name}' of {source} has the suffix {suffix!r}; expected one dot "
                    f"and lower-case letters, such as '.off'"
                )
            if suffix in taken:
                raise PluginError(
                    f"the suffix '{suffix}' is read by both '{taken[suffix][0]}' of "
                    f"{taken[suffix][1]} and '{name}' of {source}; uninstall one"
                )
            taken[suffix] = (name, source)
    for name, (exporter, source) in sorted(exporters.items()):
        if name in outputs:
            raise PluginError(
                f"exporter '{name}' of {source} has the name of an output of {outputs[name][1]}; "
                f"uninstall one, or rename it, for example to '<vendor>-{name}'"
            )
        if not isinstance(exporter.suffix, str) or not _WRITTEN.fullmatch(exporter.suffix):
            raise PluginError(
                f"exporter '{name}' of {source} has the suffix {exporter.suffix!r}; expected a dot "
                f"and lower-case letters, such as '.ply'"
            )


def _check_table(
    name: str, reader: PartReader, source: PluginSource, tables: dict[str, tuple[Any, PluginSource]]
) -> None:
    """Refuse a reader whose key of ``[part]`` is taken, or comes without a table."""
    who = f"part reader '{name}' of {source}"
    if bool(reader.key) != (reader.table is not None):
        raise PluginError(f"{who} has a key of [part] or a table for it; expected both or neither")
    if reader.key in dir(PartSpec) or reader.key in PartSpec.model_fields:
        raise PluginError(f"{who} adds the key {reader.key!r}, which [part] has already; rename it")
    table, other = tables.setdefault(reader.key, (reader.table, source))
    if table is not reader.table:
        raise PluginError(
            f"{who} adds the key {reader.key!r} to [part], as {other} does; uninstall one"
        )


def check_repairers(repairers: _Shelf) -> None:
    """Refuse repairers with the name of a way of gradedesign's own.

    Raises `PluginError`: names them.
    """
    for name in OWN_REPAIRS:
        if name in repairers:
            raise PluginError(
                f"repairer '{name}' of {repairers[name][1]} has the name of a way that gradedesign "
                f"repairs itself ({', '.join(OWN_REPAIRS)}); rename it"
            )


def hook_names() -> list[str]:
    """Names of every hook."""
    return [name for name in vars(hookspecs) if name.startswith("gradedesign_")]


def unmarked_hooks(
    manager: pluggy.PluginManager, sources: Mapping[str, PluginSource]
) -> Iterator[str]:
    """One sentence for every function that is named like a hook and lacks the marker.

    ``sources``: by the name under which a plugin is registered.
    """
    for name, source in sorted(sources.items()):
        for hook in hook_names():
            function = getattr(manager.get_plugin(name), hook, None)
            if callable(function) and not hasattr(function, f"{hookspecs.GROUP}_impl"):
                yield (
                    f"function {hook} of plugin '{source.entry_point}' ({source}) is never called: "
                    f"it lacks @hookimpl, from gradedesign import hookimpl"
                )


def check_keys(
    kinds: Mapping[str, tuple[LimitKind | ComponentKind, PluginSource]],
    table: type[Table],
    section: str,
    noun: str,
) -> None:
    """Refuse a kind whose list would take the place of a key of the core.

    ``kinds``: kind and source by name. ``table``: to which the lists are added.
    ``section``, ``noun``: name of that table, and of such a kind. Raises `PluginError`.
    """
    own = {field.alias or name for name, field in table.model_fields.items()}
    for name, (kind, source) in kinds.items():
        if kind.entry is not None and name in own | set(dir(table)):
            raise PluginError(
                f"{noun} '{name}' of {source} adds a key that [{section}] has already; rename it, "
                f"for example to 'my_{name}'"
            )
