"""Registering plugins: installed distributions, or modules that a caller imported."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from importlib import metadata
from types import ModuleType

import pluggy

from gradedesign.common.values.plugins_by_name import plugins_are_off
from gradedesign.design.resolve.registry import PluginFailure, PluginSource
from gradedesign.errors import Interrupted, PluginError
from gradedesign.program.host import builtin, hookspecs

log = logging.getLogger(__name__)


def distribution_source(
    distribution: metadata.Distribution | None, entry_point: str, fallback: str
) -> PluginSource:
    """Describe where a plugin comes from; ``fallback`` names a distribution to look up."""
    if distribution is not None:
        return PluginSource(
            entry_point=entry_point, distribution=distribution.name, version=distribution.version
        )
    try:
        version = metadata.version(fallback)
    except metadata.PackageNotFoundError:
        version = ""
    return PluginSource(entry_point=entry_point, distribution=fallback, version=version)


def register(
    manager: pluggy.PluginManager,
    sources: dict[str, PluginSource],
    plugin: object,
    source: PluginSource,
) -> None:
    """Register one plugin under a unique name; a wrong hook signature is an error."""
    name = f"{source.entry_point} ({source.distribution})"
    if name in sources or manager.is_registered(plugin):
        raise PluginError(
            f"plugin '{source.entry_point}' of {source} is registered twice; "
            f"keep one entry point per module"
        )
    try:
        manager.register(plugin, name=name)
    except pluggy.PluginValidationError as error:
        raise PluginError(
            f"plugin '{source.entry_point}' of {source} does not match a hook: {error}"
        ) from error
    sources[name] = source


def register_modules(
    manager: pluggy.PluginManager, sources: dict[str, PluginSource], plugins: Iterable[ModuleType]
) -> tuple[PluginFailure, ...]:
    """Register modules that the caller imported."""
    for module in plugins:
        source = PluginSource(
            entry_point=module.__name__, distribution=f"module {module.__name__}", version=""
        )
        register(manager, sources, module, source)
    return ()


def load_installed(
    manager: pluggy.PluginManager, sources: dict[str, PluginSource]
) -> tuple[PluginFailure, ...]:
    """Load the entry points one by one; a failure disables only itself."""
    if plugins_are_off():
        log.info("GRADEDESIGN_DISABLE_PLUGINS is set: no installed plugin is loaded")
        return ()
    failures: list[PluginFailure] = []
    points = metadata.entry_points(group=hookspecs.GROUP)
    for point in sorted(points, key=lambda p: (p.name, p.value)):
        if point.value == builtin.__name__:
            continue
        source = distribution_source(point.dist, point.name, point.value)
        try:
            plugin = point.load()
        except (KeyboardInterrupt, Interrupted):
            raise
        except BaseException as error:  # noqa: BLE001 - foreign code may raise anything
            failures.append(failure_of(source, error))
            continue
        register(manager, sources, plugin, source)
    return tuple(failures)


def failure_of(source: PluginSource, error: BaseException) -> PluginFailure:
    """Record why a plugin is disabled."""
    log.debug("plugin of %s failed", source, exc_info=error)
    return PluginFailure(
        entry_point=source.entry_point,
        distribution=str(source),
        error=f"{type(error).__name__}: {error}",
    )
