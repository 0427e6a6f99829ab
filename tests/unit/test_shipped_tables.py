"""Tables beside a distribution's code become its laws, by file name."""

from importlib import resources

import pytest

from gradedesign import PluginError, shipped_laws


@pytest.fixture
def package(tmp_path, monkeypatch, request):
    """A folder of data that can be imported, under a name of its own."""
    folder = tmp_path / f"cells_of_{request.node.name}"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    return folder


def test_every_table_is_a_law(package):
    shipped = resources.files("gradedesign_cells_strut.properties")
    for name in ("sc.json", "octet.json"):
        (package / name).write_text((shipped / name).read_text())
    (package / "notes.txt").write_text("no table")
    laws = list(shipped_laws(package.name))
    assert [law.name for law in laws] == ["octet-computed", "sc-computed"]
    assert {law.kind for law in laws} == {"computed"}


def test_a_damaged_table_is_named(package):
    (package / "broken.json").write_text('{"gradedesign property table": 1, "name": "broken"}')
    with pytest.raises(PluginError, match="property table 'broken' is damaged"):
        list(shipped_laws(package.name))


def test_an_empty_folder_has_none(package):
    assert list(shipped_laws(package.name)) == []
