"""Installed plugins: folders with a dist-info, as pip leaves them, that work, fail and clash."""

import pytest

from gradedesign import CaseError, PluginError
from gradedesign.common.values.plugins_by_name import DISABLE_VARIABLE
from gradedesign.design.resolve.registry import lookup
from gradedesign.program.host.registry import build_registry

CELL = """
import numpy as np
from gradedesign import CellFamily, hookimpl

@hookimpl
def gradedesign_cell_families():
    yield CellFamily(name="{name}", shape=lambda u: np.cos(2 * np.pi * u).sum(axis=0))
"""


def test_a_good_plugin_is_found_with_its_source(install):
    install("fake-good", CELL.format(name="fake-cell"))
    registry = build_registry()
    assert "fake-cell" in registry.cell_families
    assert registry.sources["cell_families"]["fake-cell"] == "fake-good 1.2"
    assert "fake-good 1.2" in [str(p) for p in registry.plugins]


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ("import no_such_module_at_all", "ModuleNotFoundError"),
        ("def broken(:", "SyntaxError"),
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("import sys; sys.exit(3)", "SystemExit"),
    ],
)
def test_a_plugin_that_fails_to_load_disables_only_itself(install, caplog, source, error):
    install("fake-broken", source)
    install("fake-good", CELL.format(name="fake-cell"))
    registry = build_registry()
    assert "fake-cell" in registry.cell_families
    (failure,) = registry.failures
    assert failure.entry_point == "fake-broken"
    assert failure.distribution == "fake-broken 1.2"
    assert error in failure.error
    assert "fake-broken" in caplog.text
    assert lookup(registry, "cell_families", "fake-cell").name == "fake-cell"
    with pytest.raises(PluginError, match="fake-broken"):
        lookup(registry, "cell_families", "cell-of-the-broken-plugin")
    with pytest.raises(PluginError, match="fake-broken"):
        build_registry(strict=True)


def test_two_plugins_with_one_name_clash(install):
    install("fake-one", CELL.format(name="fake-cell"))
    install("fake-two", CELL.format(name="fake-cell"), version="7.0")
    with pytest.raises(PluginError, match=r"'fake-cell'.*fake-one 1\.2.*fake-two 7\.0"):
        build_registry()


def test_a_misspelt_hook_is_an_error_with_its_distribution(install):
    install("fake-misspelt", CELL.format(name="fake-cell").replace("_families", "_family"))
    with pytest.raises(PluginError, match=r"fake-misspelt 1\.2.*gradedesign_cell_family"):
        build_registry()


def test_the_environment_can_disable_installed_plugins(install, monkeypatch):
    install("fake-good", CELL.format(name="fake-cell"))
    monkeypatch.setenv(DISABLE_VARIABLE, "1")
    registry = build_registry()
    assert not registry.cell_families
    assert "stl" in registry.readers
    with pytest.raises(CaseError, match="fake-cell"):
        lookup(registry, "cell_families", "fake-cell")


def test_the_built_ins_are_registered_once(install):
    install("fake-good", CELL.format(name="fake-cell"))
    assert [p.entry_point for p in build_registry().plugins].count("builtin") == 1


UNMARKED = (
    CELL.replace("@hookimpl\n", "") + "\n@hookimpl\ndef gradedesign_materials():\n    return ()\n"
)


def test_a_hook_without_its_marker_is_warned_of(install, cli, caplog):
    install("fake-unmarked", UNMARKED.format(name="fake-cell"))
    words = "function gradedesign_cell_families of plugin 'fake-unmarked' (fake-unmarked 1.2)"
    registry = build_registry()
    assert "fake-unmarked 1.2" in [str(p) for p in registry.plugins]
    assert not registry.failures
    (warning,) = registry.warnings
    assert warning.startswith(words)
    assert "@hookimpl" in warning
    assert words in caplog.text
    with pytest.raises(PluginError, match="lacks @hookimpl"):
        lookup(registry, "cell_families", "fake-cell")
    with pytest.raises(PluginError, match="lacks @hookimpl"):
        build_registry(strict=True)
    told = cli("materials")
    assert told.code == 0
    assert f"warning: {words}" in told.err
    assert cli("materials", "--strict-plugins").code == 7


def test_only_functions_with_the_name_of_a_hook_need_the_marker(install):
    helper = "\ndef gradedesign_helper():\n    pass\ngradedesign_readers = None\n"
    install("fake-good", CELL.format(name="fake-cell") + helper)
    assert build_registry(strict=True).warnings == ()
