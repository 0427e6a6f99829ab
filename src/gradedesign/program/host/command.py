"""Commands of plugins: their record, their hook, and finding them without loading other plugins.

A distribution names its commands in the entry-point group ``gradedesign.commands``, each with the
module whose hook registers it: ``--help`` loads these modules and no cells, laws or formats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from typing import Any

import pluggy

from gradedesign.common.values.plugins_by_name import plugins_are_off, supplied_by
from gradedesign.errors import CaseError, Interrupted, PluginError
from gradedesign.program.host.markers import GROUP, hookspec

COMMAND_GROUP = "gradedesign.commands"


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command of the command line.

    Attributes
    ----------
    name : str
        The word after ``gradedesign``, as in the entry point.
    call : callable
        As typer takes it: its parameters are the arguments and options, its docstring the help. It
        prints, and raises ``typer.Exit`` with an exit code or a `GradeDesignError`. Whatever is
        heavy it imports when it is called.
    layout : callable or None
        Without arguments: the table (`gradedesign.commands.Table`) of the file that it reads, for
        ``gradedesign schema``.
    resumable : str
        How the command goes on after an interruption, such as ``go on with the same command``.
    """

    name: str
    call: Callable[..., None]
    layout: Callable[[], Any] | None = None
    resumable: str = ""


@hookspec
def gradedesign_commands() -> Iterable[Command]:
    """Register commands, which the entry-point group ``gradedesign.commands`` names too.

    Examples
    --------
    >>> from gradedesign import Command, hookimpl
    >>> def weigh(volume: float) -> None:
    ...     print(f"{4.43e-3 * volume:g} g")
    >>> @hookimpl
    ... def gradedesign_commands():
    ...     yield Command(name="weigh", call=weigh)
    >>> [command.name for command in gradedesign_commands()]
    ['weigh']
    """
    return ()


def command_names() -> list[str]:
    """Names of the commands of installed plugins, sorted."""
    return sorted({point.name for point in _points()})


def load_command(name: str) -> Command:
    """Load a command of a plugin, and no other plugin.

    Raises CaseError if none has it; names the plugin of this project that does. Raises PluginError
    if two have it, or its module cannot be loaded or does not register it.
    """
    points = [point for point in _points() if point.name == name]
    if not points:
        near = supplied_by("commands", name) or "gradedesign --help lists the commands"
        raise CaseError(f"no command named '{name}'; {near}")
    if len(points) > 1:
        sources = " and ".join(sorted(_source(point) for point in points))
        raise PluginError(f"the command '{name}' is supplied by {sources}; uninstall one")
    (point,) = points
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(_Specs)
    try:
        manager.register(point.load())
        found = [one for records in manager.hook.gradedesign_commands() for one in records]
    except (KeyboardInterrupt, Interrupted):
        raise
    except BaseException as error:
        raise PluginError(
            f"the command '{name}' of {_source(point)} cannot be loaded: "
            f"{type(error).__name__}: {error}"
        ) from error
    for command in found:
        if isinstance(command, Command) and command.name == name:
            return command
    raise PluginError(
        f"{_source(point)} names the command '{name}', which its hook gradedesign_commands does "
        f"not return"
    )


class _Specs:
    """Namespace of the one hook that is called here."""

    gradedesign_commands = staticmethod(gradedesign_commands)


def _points() -> Iterable[metadata.EntryPoint]:
    if plugins_are_off():
        return ()
    return _installed(metadata.entry_points)


@lru_cache(maxsize=1)
def _installed(
    entry_points: Callable[..., Iterable[metadata.EntryPoint]],
) -> Iterable[metadata.EntryPoint]:
    """Entry points of commands, read once in a process: ``--help`` asks for them 30 times."""
    return entry_points(group=COMMAND_GROUP)


def _source(point: metadata.EntryPoint) -> str:
    return point.value if point.dist is None else f"{point.dist.name} {point.dist.version}"
