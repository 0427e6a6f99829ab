"""Plugins that try to end the program: at import, in a hook, in what a record holds."""

import numpy as np
import pytest

from gradedesign import CellFamily, CellMaker, PluginError
from gradedesign.geometry.cell.maker import make_cell
from gradedesign.geometry.cell.shape import blamed_shape, evaluate_shape
from gradedesign.program.host.registry import build_registry

HEAD = """
import sys
import numpy as np
from gradedesign import CellFamily, hookimpl

class Gone(BaseException):
    pass
"""
AT_IMPORT = "{ending}"
IN_A_HOOK = """
@hookimpl
def gradedesign_cell_families():
    {ending}
"""
IN_A_SHAPE = """
def shape(u):
    {ending}

@hookimpl
def gradedesign_cell_families():
    yield CellFamily(name="fake-cell", shape=shape)
"""
ENDINGS = pytest.mark.parametrize(
    ("ending", "words"),
    [
        ("sys.exit(0)", "SystemExit: 0"),
        ("sys.exit()", "SystemExit"),
        ("raise Gone('x')", "Gone: x"),
    ],
)


@ENDINGS
@pytest.mark.parametrize("source", [AT_IMPORT, IN_A_HOOK], ids=["import", "hook"])
def test_one_that_ends_while_loading_is_disabled(install, cli, source, ending, words):
    install("fake-ending", HEAD + source.format(ending=ending))
    ended = cli("materials")
    assert ended.code == 0, ended.err
    assert "Ti-6Al-4V" in ended.out
    assert "disabled plugin 'fake-ending' of fake-ending 1.2" in ended.err
    assert words in ended.err
    strict = cli("materials", "--strict-plugins")
    assert strict.code == 7
    assert words in strict.err
    asked = cli("cells", "fake-cell")
    assert asked.code == 7
    assert words in asked.err


@ENDINGS
def test_a_shape_that_ends_is_an_error_of_its_plugin(install, cli, ending, words):
    install("fake-ending", HEAD + IN_A_SHAPE.format(ending=ending))
    ended = cli("cells", "fake-cell")
    assert ended.code == 7
    assert "cell 'fake-cell' failed" in ended.err
    assert words in ended.err


def ending(*_, **__):
    raise SystemExit(0)


def test_whatever_ends_a_command_from_inside_is_blamed_on_a_plugin(cli, monkeypatch):
    # Stands for code that no guard knows, such as the callables of a law.
    monkeypatch.setattr("gradedesign.program.commands.lists.registry_for", ending)
    ended = cli("materials")
    assert ended.code == 7
    assert "tried to end the program: SystemExit: 0" in ended.err


def interrupted(*_, **__):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    "call",
    [
        lambda shape: evaluate_shape(CellFamily(name="a", shape=shape), {}, np.zeros((3, 2))),
        lambda shape: blamed_shape(CellFamily(name="a", shape=shape))(np.zeros((3, 2))),
        lambda shape: make_cell(CellMaker(name="a", make=shape), "b", {}, None),
    ],
    ids=["evaluated", "sampled", "made"],
)
def test_an_interruption_stays_one(call):
    with pytest.raises(PluginError, match="'a'"):
        call(ending)
    with pytest.raises(KeyboardInterrupt):
        call(interrupted)


def test_an_interruption_while_loading_stays_one(install):
    install("fake-slow", "raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        build_registry()
