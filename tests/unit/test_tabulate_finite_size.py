"""`gradedesign tabulate --finite-size`: what it writes, and its refusals."""

from gradedesign import read_finite_size_table
from gradedesign.cli import tabulate_finite_size as module
from gradedesign.homogenise.finite_size_rows import finite_size_table
from gradedesign.plugin.registry import build_registry


def test_tables_are_written_and_a_failure_stops_none(cli, tmp_path, monkeypatch):
    shipped = build_registry().finite_size_tables["sc"]
    asked = []

    def compute(family, *, poissons_ratio):
        asked.append((family.name, poissons_ratio))
        if family.name == "bccz":
            return finite_size_table(family)
        return shipped

    monkeypatch.setattr(module, "finite_size_table", compute)
    folder = tmp_path / "new"
    ended = cli("tabulate", "bccz", "sc", "sc", "--finite-size", "-o", folder, "--nu", "0.33")
    assert ended.code == 6
    assert "expected cubic" in ended.err
    assert asked == [("bccz", 0.33), ("sc", 0.33)]
    assert [path.name for path in folder.iterdir()] == ["sc.json"]
    again = read_finite_size_table((folder / "sc.json").read_text(encoding="utf-8"))
    assert again.rows == shipped.rows


def test_what_it_cannot_do_is_refused(cli, tmp_path):
    for words, match in (
        ((), "name the cells"),
        (("sk",), "'sk'"),
        (("sc", "--resolution", "24"), "leave out --resolution"),
        (("sc", "--buckling"), "--scheduler and --buckling"),
    ):
        ended = cli("tabulate", *words, "--finite-size", "-o", tmp_path / "out")
        assert ended.code == 2
        assert match in " ".join(ended.err.split())
    (tmp_path / "file").write_text("", encoding="utf-8")
    ended = cli("tabulate", "sc", "--finite-size", "-o", tmp_path / "file")
    assert ended.code == 2
    assert "cannot make folder" in ended.err
