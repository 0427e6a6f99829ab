"""The command line: options, exit codes, and what an error looks like."""

from __future__ import annotations

import logging
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from gradedesign.cli import check as check_command
from gradedesign.cli import doctor as doctor_command
from gradedesign.cli import lists as list_commands
from gradedesign.cli import run as run_command
from gradedesign.cli import validate as validate_command
from gradedesign.errors import GradeDesignError

app = typer.Typer(
    name="gradedesign",
    help="The lightest printable lattice version of a part that still meets its limits.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

INTERRUPTED = 130
INTERNAL = 70

#: Set by --debug: errors keep their traceback.
_DEBUG_FLAG = "--debug"


@app.callback()
def common(
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks and log lines.")] = False,
) -> None:
    """Options of every command."""
    logging.basicConfig(level=logging.INFO if debug else logging.ERROR)


@app.command()
def run(
    case: Annotated[Path, typer.Argument(help="The case file, or its folder.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Run folder [runs/<case name>].")
    ] = None,
    resume: Annotated[bool, typer.Option(help="Go on with an interrupted run.")] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace earlier results.")] = False,
    allow_outside: Annotated[
        bool, typer.Option(help="Let the case name files outside its folder.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print result.json.")] = False,
) -> None:
    """Run the whole loop: the lightest lattice that meets the limits, proven."""
    code = run_command.run(
        case,
        output,
        resume=resume,
        overwrite=overwrite,
        allow_outside=allow_outside,
        as_json=as_json,
    )
    raise typer.Exit(code)


@app.command()
def check(
    case: Annotated[Path, typer.Argument(help="The case file, or its folder.")],
    allow_outside: Annotated[
        bool, typer.Option(help="Let the case name files outside its folder.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print plain data.")] = False,
) -> None:
    """Dry run in seconds: repairs, regions, free motions, predicted size and time."""
    check_command.check(case, allow_outside=allow_outside, as_json=as_json)


@app.command()
def validate(
    folders: Annotated[list[Path] | None, typer.Argument(help="Case folders [cases].")] = None,
    keyword: Annotated[
        str, typer.Option("-k", help="Only cases whose name contains this (or, not allowed).")
    ] = "",
    update: Annotated[bool, typer.Option(help="Write the new values.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print plain data.")] = False,
) -> None:
    """Run case folders and compare with their expected.toml."""
    raise typer.Exit(validate_command.validate(folders, keyword, update=update, as_json=as_json))


@app.command()
def cells(
    name: Annotated[str | None, typer.Argument(help="One family in full.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print plain data.")] = False,
) -> None:
    """List the installed cell families with their windows, laws and sources."""
    list_commands.cells(name, as_json=as_json)


@app.command()
def materials(
    as_json: Annotated[bool, typer.Option("--json", help="Print plain data.")] = False,
) -> None:
    """List the materials with their values and sources."""
    list_commands.materials(as_json=as_json)


@app.command()
def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print plain data.")] = False,
) -> None:
    """Show versions, plugins, memory and whether pictures can be drawn."""
    doctor_command.doctor(as_json=as_json)


def main() -> None:
    """Run the command line; every error ends with its exit code and one message."""
    debug = _DEBUG_FLAG in sys.argv
    try:
        app()
    except GradeDesignError as error:
        if debug:
            traceback.print_exc()
        typer.echo(f"error: {error}", err=True)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        typer.echo("interrupted; go on with the same command and --resume", err=True)
        sys.exit(INTERRUPTED)
    except Exception as error:
        traceback.print_exc()
        typer.echo(f"internal error: {error!r}; please report it with the lines above", err=True)
        sys.exit(INTERNAL)
