"""The command line: options, exit codes, and what an error looks like.

A command imports what it runs when it is called: ``--help`` needs none of it.
"""

from __future__ import annotations

import errno
import logging
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.errors import GradeDesignError, Interrupted, PluginError, ResourceError
from gradedesign.program.commands.interrupt import Interruption
from gradedesign.program.commands.loading import loading_lines
from gradedesign.program.commands.options import with_options
from gradedesign.program.host.command import Command, command_names, load_command
from gradedesign.program.host.completion import completed

#: Errors keep their traceback.
_DEBUG_FLAG = "--debug"


class Commands(TyperGroup):
    """The commands; each ends with one of our exit codes, whatever it runs."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands: ours, then those of plugins that can be loaded."""
        names = super().list_commands(ctx)
        for name in command_names():
            # One that cannot be loaded says why when it is called.
            with suppress(PluginError):
                names.append(load_command(name).name)
        return names

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Find a command, ours or a plugin's.

        Raises CaseError if a plugin of this project that is not installed has it. Raises
        PluginError if a plugin gives one of our names to its own, or cannot be loaded.
        """
        own = super().get_command(ctx, cmd_name)
        if own is None and not (cmd_name in command_names() or supplied_by("commands", cmd_name)):
            return None
        if own is None:
            return _of_plugin(load_command(cmd_name))
        if cmd_name in command_names():
            raise PluginError(
                f"a plugin has a command '{cmd_name}', which gradedesign has itself; uninstall it"
            )
        return own

    def invoke(self, ctx: Any) -> Any:
        """Run a command.

        Raises PluginError if something called ``sys.exit`` or raised what is no ``Exception``: no
        code of gradedesign does, so it was a plugin.
        """
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, Interrupted, Exception):
            raise
        except BaseException as error:
            raise PluginError(
                f"a plugin tried to end the program: {type(error).__name__}: {error}; "
                f"{_DEBUG_FLAG} shows where, GRADEDESIGN_DISABLE_PLUGINS=1 runs without plugins"
            ) from error


def _of_plugin(command: Command) -> Any:
    """A plugin's command as click has them; an interruption tells how it goes on."""

    @wraps(command.call)
    def call(*arguments: Any, **options: Any) -> None:
        try:
            command.call(*arguments, **options)
        except Interrupted as error:
            raise Interrupted(command.resumable) from error

    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(command.name)(call)
    return typer.main.get_command(alone)


app = typer.Typer(
    name="gradedesign",
    cls=Commands,
    help="The lightest printable lattice version of a part that still meets its limits.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

#: Exit code of an error of the program itself: EX_SOFTWARE of sysexits.h.
_INTERNAL = 70

_CasePath = Annotated[Path, typer.Argument(help="The case file, or its folder.")]
Outside = Annotated[
    bool, typer.Option("--allow-outside", help="Let the case name files outside its folder.")
]
Strict = Annotated[
    bool, typer.Option("--strict-plugins", help="Stop if an installed plugin fails to load.")
]
Json = Annotated[bool, typer.Option("--json", help="Print plain data for another program.")]
_Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace earlier results.")]


def _print_version(requested: bool) -> None:
    """Print the version of the program and exit, if asked to."""
    if requested:
        typer.echo(f"gradedesign {version('gradedesign')}")
        raise typer.Exit


@app.callback()
def common(
    debug: Annotated[
        bool, typer.Option(_DEBUG_FLAG, help="Show tracebacks and log lines.")
    ] = False,
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Options of every command, given before its name."""
    logging.basicConfig(level=logging.INFO if debug else logging.ERROR)


def _require_text(case: Path, *, allow_outside: bool) -> None:
    """Look at the text of a case before its command is loaded: a mistake costs no loading."""
    from gradedesign.design.case.read_case import require_case_text

    require_case_text(case, allow_outside=allow_outside)


@app.command()
def run(
    case: _CasePath,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Run folder [runs/<case name>].")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with an interrupted run.")
    ] = False,
    overwrite: _Overwrite = False,
    allow_outside: Outside = False,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """Find the lightest lattice that meets the limits, or build that of a stated density."""
    _require_text(case, allow_outside=allow_outside)
    with loading_lines(err=as_json) as on_loaded:
        from gradedesign.program.commands.run import run as command

        code = command(
            case,
            output,
            resume=resume,
            overwrite=overwrite,
            allow_outside=allow_outside,
            strict_plugins=strict_plugins,
            as_json=as_json,
            on_loaded=on_loaded,
        )
    raise typer.Exit(code)


@app.command()
def new(
    part: Annotated[Path, typer.Argument(help="The part: STL, 3MF, STEP or what doctor lists.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the case [./<part's name>].")
    ] = None,
    units: Annotated[
        str | None,
        typer.Option("--units", help="Unit of a file that carries none, such as mm or inch."),
    ] = None,
    repair: Annotated[
        str, typer.Option("--repair", help="safe, or auto where the file is damaged.")
    ] = "safe",
    bodies: Annotated[
        str, typer.Option("--bodies", help="one, join where solids touch, or all.")
    ] = "one",
    material: Annotated[
        str | None,
        typer.Option(
            "--material",
            help="Its name, see gradedesign materials.",
            autocompletion=completed("materials"),
        ),
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", help="Region that is held; may be repeated.")
    ] = None,
    load: Annotated[
        list[str] | None,
        typer.Option("--load", help="REGION=FX,FY,FZ, force in N; may be repeated."),
    ] = None,
    safety_factor: Annotated[
        str | None, typer.Option("--safety-factor", help="On the yield strength, such as 2.")
    ] = None,
    displacement: Annotated[
        list[str] | None,
        typer.Option("--displacement", help="REGION=LIMIT in mm, or REGION=2 x solid."),
    ] = None,
    min_wall: Annotated[
        str | None, typer.Option("--min-wall", help="Thinnest wall of the printer, mm.")
    ] = None,
    cell: Annotated[
        str | None,
        typer.Option(
            "--cell",
            help="Its name, see gradedesign cells.",
            autocompletion=completed("cell_families"),
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option("--size", help="Of a cell, mm [half the part's thickness].")
    ] = None,
    ask: Annotated[
        bool, typer.Option("--ask/--no-ask", help="Ask for what no option states, at a terminal.")
    ] = True,
    estimate: Annotated[
        bool, typer.Option("--estimate", help="Also predict masses, as check does.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the part and its regions; write nothing.")
    ] = False,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """Begin a case: from a part's holes and flat ends, by answers to a few questions."""
    from gradedesign.program.commands.answers import typed_by_key
    from gradedesign.program.commands.new import new as command

    code = command(
        part,
        output,
        units=units,
        repair=repair,
        bodies=bodies,
        typed=typed_by_key(material, fix, load, safety_factor, displacement, min_wall, cell, size),
        ask=ask,
        estimate=estimate,
        dry_run=dry_run,
        strict_plugins=strict_plugins,
        as_json=as_json,
    )
    raise typer.Exit(code)


@app.command()
def check(
    case: _CasePath,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Picture of loads and supports [runs/<case>-check/loads.png]."
        ),
    ] = None,
    estimate: Annotated[
        bool,
        typer.Option(
            "--estimate", help="Also a first estimate of density and mass; it meshes the part."
        ),
    ] = False,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Draw loads and supports.")
    ] = True,
    allow_outside: Outside = False,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """Dry run in seconds: regions, holes, loads, cell sizes, predicted memory and time."""
    _require_text(case, allow_outside=allow_outside)
    from gradedesign.program.commands.check import check as command

    code = command(
        case,
        output,
        estimate=estimate,
        picture=picture,
        allow_outside=allow_outside,
        strict_plugins=strict_plugins,
        as_json=as_json,
    )
    raise typer.Exit(code)


@app.command()
def judge(
    case: _CasePath,
    body: Annotated[Path, typer.Argument(help="The body, in the place of the case's part.")],
    units: Annotated[
        str | None,
        typer.Option("--units", help="Unit of a file that carries none [that of the part: mm]."),
    ] = None,
    allow_outside: Outside = False,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """Judge a body made elsewhere by the limits of a case, as a design of ours."""
    _require_text(case, allow_outside=allow_outside)
    from gradedesign.program.commands.judge import judge as command

    code = command(
        case,
        body,
        units=units,
        allow_outside=allow_outside,
        strict_plugins=strict_plugins,
        as_json=as_json,
    )
    raise typer.Exit(code)


@app.command()
def preview(
    case: Annotated[Path, typer.Argument(help="The case file, its folder, or a run folder.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the page instead of serving it.")
    ] = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="Load the page again whenever the case is saved.")
    ] = False,
    port: Annotated[
        int | None, typer.Option("--port", help="Port on this machine [one that is free].")
    ] = None,
    allow_outside: Outside = False,
    strict_plugins: Strict = False,
) -> None:
    """Show a case or a finished run in the browser, and what selects the face one clicks."""
    from gradedesign.program.commands.preview import preview as command

    command(
        case,
        output,
        port=port,
        watch=watch,
        allow_outside=allow_outside,
        strict_plugins=strict_plugins,
    )


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="The folder of a finished run.")],
) -> None:
    """Write the report of a finished run again."""
    from gradedesign.program.commands.report import report as command

    command(folder)


@app.command()
def cells(
    name: Annotated[
        str | None,
        typer.Argument(help="One family in full.", autocompletion=completed("cell_families")),
    ] = None,
    makers: Annotated[
        bool, typer.Option("--makers", help="List the makers of cells that a case describes.")
    ] = False,
    strict_plugins: Strict = False,
    as_json: Json = False,
) -> None:
    """List the installed cell families with their windows, laws and sources."""
    from gradedesign.program.commands import lists

    if makers:
        lists.cell_makers(strict_plugins=strict_plugins, as_json=as_json)
        return
    lists.cells(name, strict_plugins=strict_plugins, as_json=as_json)


@app.command()
def materials(strict_plugins: Strict = False, as_json: Json = False) -> None:
    """List the materials with their values and sources."""
    from gradedesign.program.commands.lists import materials as command

    command(strict_plugins=strict_plugins, as_json=as_json)


@app.command()
def processes(strict_plugins: Strict = False, as_json: Json = False) -> None:
    """List the printing processes with what was measured of them and their sources."""
    from gradedesign.program.commands.lists import processes as command

    command(strict_plugins=strict_plugins, as_json=as_json)


@app.command()
def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="File to write [standard output].")
    ] = None,
    study: Annotated[
        bool, typer.Option("--study", help="Of the study of `gradedesign sweep`.")
    ] = False,
) -> None:
    """Print the JSON schema of case files, for completion and checks in editors."""
    from gradedesign.program.commands.schema import schema as command

    command(output, study=study)


@app.command()
def doctor(strict_plugins: Strict = False, as_json: Json = False) -> None:
    """Show versions, plugins, cores and memory."""
    from gradedesign.program.commands.doctor import doctor as command

    command(strict_plugins=strict_plugins, as_json=as_json)


def run_command(words: Sequence[str], interruption: Interruption) -> NoReturn:
    """Run the command line and exit; every error is one message and its exit code.

    Raises Interrupted if so, also where code between here and there made another exception of it.

    ``words``: its arguments. ``interruption``: whether somebody asked to end.
    """
    debug = _DEBUG_FLAG in words
    try:
        app(words)
    except Exception as error:
        if interruption.stop_requested:
            raise Interrupted from error
        _end(error, debug=debug)
    sys.exit(0)


def _end(error: Exception, *, debug: bool) -> NoReturn:
    """Exit as an error asks for."""
    if isinstance(error, GradeDesignError):
        _fail(str(error), error.exit_code, debug=debug)
    if isinstance(error, MemoryError):
        _fail(
            "out of memory; take larger cells ([lattice] size), a coarser [part] mesh_size or "
            "fewer [run] elements_per_wall",
            ResourceError.exit_code,
            debug=debug,
        )
    if isinstance(error, BrokenPipeError):
        _leave_the_pipe()
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        _fail(f"{error}; free some space", ResourceError.exit_code, debug=debug)
    _report_internal(error)


def _fail(message: str, code: int, *, debug: bool) -> NoReturn:
    """Print an error's message, and its traceback if asked for, and exit."""
    if debug:
        traceback.print_exc()
    typer.echo(f"error: {with_options(message)}", err=True)
    sys.exit(code)


def _report_internal(error: Exception) -> NoReturn:
    """Print what a maintainer needs, and exit."""
    traceback.print_exc()
    typer.echo(f"internal error: {error!r}; please report it with the lines above", err=True)
    sys.exit(_INTERNAL)


def _leave_the_pipe() -> NoReturn:
    """End quietly when whoever reads the output has gone, as ``| head`` does."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(0)
