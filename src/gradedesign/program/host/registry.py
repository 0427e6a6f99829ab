"""Building the registry: every record that the built-ins and the installed plugins supply."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType, ModuleType
from typing import Any, Literal, NamedTuple

import pluggy

from gradedesign.common.values.suggest import nearest
from gradedesign.design.printing.process import Process
from gradedesign.design.resolve.registry import NOUNS, Kind, PluginFailure, PluginSource, Registry
from gradedesign.errors import Interrupted, PluginError
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.maker import CellMaker
from gradedesign.geometry.formats.exporter import Exporter
from gradedesign.geometry.lattice.component_kind import ComponentKind
from gradedesign.geometry.lattice.field_reader import FieldReader
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.part.reader import PartReader
from gradedesign.geometry.part.repairer import Repairer
from gradedesign.geometry.tets.mesher import Mesher
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.solver.eigen_solver import EigenSolver
from gradedesign.mechanics.solver.linear_solver import LinearSolver
from gradedesign.program.host import builtin, hookspecs
from gradedesign.program.host.installed import (
    distribution_source,
    failure_of,
    load_installed,
    register,
    register_modules,
)
from gradedesign.program.host.plugin_checks import (
    check_formats,
    check_keys,
    check_repairers,
    hook_names,
    unmarked_hooks,
)
from gradedesign.program.outputs.output import Output
from gradedesign.program.outputs.report_section import ReportSection

log = logging.getLogger(__name__)

_DASHED = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
#: A key of the case file.
_UNDERSCORED = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_SPACED = re.compile(r"[A-Za-z0-9]([A-Za-z0-9 ._-]*[A-Za-z0-9])?")


class _Shelf(NamedTuple):
    """Kind of entry of a hook: its record type and the form of its names."""

    record: type
    names: re.Pattern[str]


_SHELVES: Mapping[Kind, _Shelf] = {
    "cell_families": _Shelf(CellFamily, _DASHED),
    "cell_makers": _Shelf(CellMaker, _DASHED),
    "scaling_laws": _Shelf(ScalingLaw, _DASHED),
    "materials": _Shelf(Material, _SPACED),
    "processes": _Shelf(Process, _DASHED),
    "readers": _Shelf(PartReader, _DASHED),
    "field_readers": _Shelf(FieldReader, _UNDERSCORED),
    "repairers": _Shelf(Repairer, _DASHED),
    "exporters": _Shelf(Exporter, _DASHED),
    "outputs": _Shelf(Output, _DASHED),
    "report_sections": _Shelf(ReportSection, _DASHED),
    "solvers": _Shelf(LinearSolver, _DASHED),
    "eigen_solvers": _Shelf(EigenSolver, _DASHED),
    "meshers": _Shelf(Mesher, _DASHED),
    "limits": _Shelf(LimitKind, _UNDERSCORED),
    "components": _Shelf(ComponentKind, _UNDERSCORED),
    "analyses": _Shelf(ExplicitAnalysis, _DASHED),
}


def build_registry(
    *,
    plugins: Literal["installed"] | Sequence[ModuleType] = "installed",
    strict: bool = False,
) -> Registry:
    """Collect the records of the built-ins and of plugins.

    ``plugins``: "installed" or sequence of modules; the entry points of group ``gradedesign``, one
    by one, unless the environment sets ``GRADEDESIGN_DISABLE_PLUGINS=1``; or these modules and
    nothing installed. ``strict``: raise for a plugin that fails to load instead of going on without
    it. Raises `PluginError` for a misspelt hook, a hook that takes arguments, a record of the wrong
    type or with an invalid name, a name supplied twice; with ``strict`` also for a plugin that
    fails to load and for a function with the name of a hook that is not marked as one, or a law of
    a cell that nothing supplies.
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
    check_keys(shelves["limits"], LimitsSpec, "limits", NOUNS["limits"])
    check_keys(shelves["components"], LatticeSpec, "lattice", NOUNS["components"])
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
            f"{NOUNS[kind]} {name!r} of plugin '{source.entry_point}' ({source}) has an invalid "
            f"name; use lower-case letters and digits joined by dashes, such as 'my-cell'"
        )
    if name in shelves[kind]:
        raise PluginError(
            f"{NOUNS[kind]} '{name}' is supplied by both {shelves[kind][name][1]} and {source}; "
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
