"""The registry: every record that the built-ins and the installed plugins supply."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType, ModuleType
from typing import Any, Literal, NamedTuple

import pluggy

from gradedesign.case.suggest import described, instead, meant, nearest, question
from gradedesign.cell.family import CellFamily
from gradedesign.cell.maker import CellMaker
from gradedesign.errors import CaseError, Interrupted, PluginError
from gradedesign.fe.eigen_solver import EigenSolver
from gradedesign.fe.linear_solver import LinearSolver
from gradedesign.limits.limit import LimitKind
from gradedesign.material.material import Material
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.mesh.mesher import Mesher
from gradedesign.output.exporter import Exporter
from gradedesign.output.output import Output
from gradedesign.part.reader import PartReader
from gradedesign.part.repairer import Repairer
from gradedesign.plugin import builtin, hookspecs
from gradedesign.plugin.format_checks import check_formats, check_repairers
from gradedesign.plugin.installed import (
    distribution_source,
    failure_of,
    load_installed,
    register,
    register_modules,
)
from gradedesign.plugin.limit_checks import check_limit_keys
from gradedesign.plugin.plugins_by_name import supplied_by
from gradedesign.plugin.records import PluginFailure, PluginSource, Registry
from gradedesign.plugin.unmarked import hook_names, unmarked_hooks
from gradedesign.verify.analysis import ExplicitAnalysis

__all__ = ["PluginFailure", "PluginSource", "Registry", "absent", "build_registry", "lookup"]

log = logging.getLogger(__name__)

_DASHED = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
#: A key of the case file.
_UNDERSCORED = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_SPACED = re.compile(r"[A-Za-z0-9]([A-Za-z0-9 ._-]*[A-Za-z0-9])?")

Kind = Literal[
    "cell_families",
    "cell_makers",
    "scaling_laws",
    "materials",
    "readers",
    "repairers",
    "exporters",
    "outputs",
    "solvers",
    "eigen_solvers",
    "meshers",
    "limits",
    "analyses",
]


class _Shelf(NamedTuple):
    """Kind of entry of a hook: its record type, the form of its names and its title."""

    record: type
    names: re.Pattern[str]
    noun: str


_SHELVES: Mapping[Kind, _Shelf] = {
    "cell_families": _Shelf(CellFamily, _DASHED, "cell family"),
    "cell_makers": _Shelf(CellMaker, _DASHED, "cell maker"),
    "scaling_laws": _Shelf(ScalingLaw, _DASHED, "scaling law"),
    "materials": _Shelf(Material, _SPACED, "material"),
    "readers": _Shelf(PartReader, _DASHED, "part reader"),
    "repairers": _Shelf(Repairer, _DASHED, "repairer"),
    "exporters": _Shelf(Exporter, _DASHED, "exporter"),
    "outputs": _Shelf(Output, _DASHED, "output"),
    "solvers": _Shelf(LinearSolver, _DASHED, "linear solver"),
    "eigen_solvers": _Shelf(EigenSolver, _DASHED, "eigenvalue solver"),
    "meshers": _Shelf(Mesher, _DASHED, "mesher"),
    "limits": _Shelf(LimitKind, _UNDERSCORED, "kind of limit"),
    "analyses": _Shelf(ExplicitAnalysis, _DASHED, "explicit analysis"),
}


def build_registry(
    *,
    plugins: Literal["installed"] | Sequence[ModuleType] = "installed",
    strict: bool = False,
) -> Registry:
    """Collect the records of the built-ins and of plugins.

    Parameters
    ----------
    plugins : "installed" or sequence of modules
        The entry points of group ``gradedesign``, one by one, unless the environment sets
        ``GRADEDESIGN_DISABLE_PLUGINS=1``; or these modules and nothing installed.
    strict : bool
        Raise for a plugin that fails to load instead of going on without it.

    Returns
    -------
    Registry

    Raises
    ------
    PluginError
        For a misspelt hook, a hook that takes arguments, a record of the wrong type or with an
        invalid name, a name supplied twice; with ``strict`` also for a plugin that fails to load
        and for a function with the name of a hook that is not marked as one, or a law of a cell
        that nothing supplies.
    """
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    sources: dict[str, PluginSource] = {}
    own = distribution_source(None, "builtin", hookspecs.GROUP)
    register(manager, sources, builtin, own)
    failures = (
        load_installed(manager, sources)
        if plugins == "installed"
        else register_modules(manager, sources, plugins)
    )
    try:
        manager.check_pending()
    except pluggy.PluginValidationError as error:
        source = sources.get(manager.get_name(error.plugin) or "")
        raise PluginError(
            f"plugin of {source}: {error}; hooks that exist: {', '.join(sorted(hook_names()))}"
        ) from error
    shelves, more = _collect(manager, sources)
    check_formats(shelves["readers"], shelves["exporters"], shelves["outputs"])
    check_repairers(shelves["repairers"])
    check_limit_keys(shelves["limits"])
    failures = tuple(sorted([*failures, *more], key=str))
    unmarked = tuple(unmarked_hooks(manager, sources))
    for failure in failures:
        log.warning("disabled %s", failure)
    orphans = _orphan_laws(shelves)
    for warning in (*unmarked, *orphans):
        log.warning("%s", warning)
    if strict and (failures or unmarked or orphans):
        raise PluginError("; ".join([*map(str, failures), *unmarked, *orphans]))
    failed = {failure.entry_point for failure in failures}
    return Registry(
        **{kind: _by_name(kind, shelves[kind]) for kind in _SHELVES},
        sources=MappingProxyType(
            {
                kind: MappingProxyType({n: str(s) for n, (_, s) in sorted(shelves[kind].items())})
                for kind in _SHELVES
            }
        ),
        plugins=tuple(s for _, s in sorted(sources.items()) if s.entry_point not in failed),
        failures=failures,
        warnings=unmarked,
    )


def lookup(registry: Registry, kind: Kind, name: str) -> Any:
    """Find a record by the name a case gives.

    Parameters
    ----------
    registry : Registry
    kind : str
        ``cell_families``, ``cell_makers``, ``scaling_laws``, ``materials``, ``readers``,
        ``repairers``, ``exporters``, ``outputs``, ``solvers``, ``eigen_solvers``, ``meshers``,
        ``limits`` or ``analyses``.
    name : str

    Raises
    ------
    CaseError
        If there is no such name; names the plugin of this project that has it, or lists the valid
        ones and the nearest spelling.
    PluginError
        The same, when a plugin that might have supplied it failed to load.
    """
    shelf: Mapping[str, Any] = getattr(registry, kind)
    if name in shelf:
        return shelf[name]
    if plugin := supplied_by(kind, name):
        raise absent(registry, f"no {_SHELVES[kind].noun} named '{name}'; {plugin}")
    near = instead(name, shelf)
    if not meant(name, shelf):
        texts = {known: getattr(record, "source", "") for known, record in shelf.items()}
        near = f"{question(described(name, texts))} {near}".lstrip()
    raise absent(registry, f"no {_SHELVES[kind].noun} named '{name}'; {near}")


def absent(registry: Registry, message: str) -> CaseError | PluginError:
    """The error of something that a case names and nothing supplies.

    Returns
    -------
    CaseError
        With the message.
    PluginError
        With the causes added, when a plugin that might have supplied it failed to load.
    """
    if registry.notes:
        causes = "; ".join(registry.notes)
        return PluginError(f"{message}. A plugin may be to blame: {causes}")
    return CaseError(message)


_Entries = dict[str, dict[str, tuple[Any, PluginSource]]]


def _collect(
    manager: pluggy.PluginManager, sources: Mapping[str, PluginSource]
) -> tuple[_Entries, list[PluginFailure]]:
    """Call every hook of every plugin; a plugin that raises loses all of its records."""
    shelves: _Entries = {kind: {} for kind in _SHELVES}
    failures: list[PluginFailure] = []
    for plugin_name, source in sorted(sources.items()):
        records: list[tuple[Kind, Any]] = []
        try:
            for kind in _SHELVES:
                for implementation in getattr(manager.hook, f"gradedesign_{kind}").get_hookimpls():
                    if implementation.plugin_name == plugin_name:
                        records += [(kind, record) for record in implementation.function()]
        except (KeyboardInterrupt, Interrupted):
            raise
        except BaseException as error:  # noqa: BLE001 - foreign code may raise anything
            failures.append(failure_of(source, error))
            continue
        for kind, record in records:
            _add(shelves, kind, record, source)
    return shelves, failures


def _add(shelves: _Entries, kind: Kind, record: Any, source: PluginSource) -> None:
    """Check one record and put it on its shelf."""
    shelf = _SHELVES[kind]
    if not isinstance(record, shelf.record):
        raise PluginError(
            f"hook gradedesign_{kind} of plugin '{source.entry_point}' ({source}) returned a "
            f"{type(record).__name__}, expected {shelf.record.__name__} records"
        )
    name = getattr(record, "name", None)
    if not isinstance(name, str) or not shelf.names.fullmatch(name):
        raise PluginError(
            f"{shelf.noun} {name!r} of plugin '{source.entry_point}' ({source}) has an invalid "
            f"name; use lower-case letters and digits joined by dashes, such as 'my-cell'"
        )
    if name in shelves[kind]:
        raise PluginError(
            f"{shelf.noun} '{name}' is supplied by both {shelves[kind][name][1]} and {source}; "
            f"uninstall one, or rename the record, for example to '<vendor>-{name}'"
        )
    shelves[kind][name] = (record, source)


def _orphan_laws(shelves: _Entries) -> list[str]:
    """Say which laws describe cells that nothing supplies: misspelt, or of a missing plugin."""
    cells = shelves["cell_families"]
    remarks = []
    for name, (law, source) in sorted(shelves["scaling_laws"].items()):
        for family in law.families:
            if family not in cells:
                guess = nearest(family, cells)
                remarks.append(
                    f"law '{name}' of {source} describes cell '{family}', which no installed "
                    f"plugin supplies: "
                    + (f'did you mean "{guess}"? Or ' if guess is not None else "")
                    + "install the plugin of that cell"
                )
    return remarks


def _by_name(kind: Kind, shelf: Mapping[str, tuple[Any, PluginSource]]) -> Mapping[str, Any]:
    """Read-only records of one kind, sorted by name."""
    log.info("registry: %d %s", len(shelf), kind)
    return MappingProxyType({name: shelf[name][0] for name in sorted(shelf)})
