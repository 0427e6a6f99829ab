"""Commands of installed plugins: listed, run, interrupted, broken, and with a name of ours."""

import pytest

COMMAND = """
import typer
from typing import Annotated
from gradedesign import Command, Interrupted, hookimpl

def weigh(volume: float, heavy: Annotated[bool, typer.Option("--heavy")] = False) -> None:
    '''Weigh a volume.'''
    if volume < 0:
        raise Interrupted
    print(f"{volume * (8 if heavy else 4):g} g")

@hookimpl
def gradedesign_commands():
    yield Command(name="{name}", call=weigh, resumable="weigh again")
"""


@pytest.fixture
def command(install, tmp_path):
    """Install a distribution whose entry point names a command."""

    def lay_out(distribution, source, name):
        install(distribution, source)
        module = distribution.replace("-", "_")
        points = tmp_path / f"{module}-1.2.dist-info" / "entry_points.txt"
        with points.open("a", encoding="utf-8") as file:
            file.write(f"[gradedesign.commands]\n{name} = {module}\n")

    return lay_out


def source(name):
    return (
        COMMAND.replace("{name}", name)
        .replace("Interrupted, hookimpl", "hookimpl")
        .replace("import typer\n", "import typer\nfrom gradedesign.errors import Interrupted\n")
    )


def test_a_command_of_a_plugin_is_listed_and_run(cli, command):
    command("fake-scales", source("weigh"), "weigh")
    listed = cli("--help").out
    assert "weigh" in listed
    assert "Weigh a volume." in listed
    assert cli("weigh", "2.5", "--heavy").out == "20 g\n"
    assert cli("weigh", "--help").code == 0
    wrong = cli("weigh", "much")
    assert wrong.code == 2
    ended = cli("weigh", "--", "-1")
    assert (ended.code, ended.err) == (130, "interrupted; weigh again\n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import no_such_module", "ModuleNotFoundError"),
        ("import sys; sys.exit(3)", "SystemExit"),
        ("x = 1", "which its hook gradedesign_commands does not return"),
    ],
)
def test_a_command_that_does_not_load_says_why_when_it_is_called(cli, command, text, words):
    command("fake-broken", text, "weigh")
    assert cli("--help").code == 0
    ended = cli("weigh", "1")
    assert ended.code == 7
    assert "fake-broken 1.2" in ended.err
    assert words in ended.err


def test_names_that_two_have_are_refused(cli, command):
    command("fake-one", source("weigh"), "weigh")
    command("fake-two", source("weigh"), "weigh")
    ended = cli("weigh", "1")
    assert ended.code == 7
    assert "fake-one 1.2 and fake-two 1.2" in ended.err
    command("fake-three", source("check"), "check")
    ended = cli("check", "case.toml")
    assert ended.code == 7
    assert "which gradedesign has itself" in ended.err
