"""`gradedesign tabulate`: tables in this process, in others, and its refusals."""

from __future__ import annotations

import socket
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from gradedesign.errors import DensityError
from gradedesign.mechanics.homogenise.table import compute_table
from gradedesign.mechanics.material.property_table import read_property_table
from gradedesign.program.commands import on_dask
from gradedesign_laboratory import run_tabulate as module


@pytest.fixture
def quick(monkeypatch):
    """Two densities instead of ten."""
    asked = []

    def compute(cell, *, poissons_ratio, resolution):
        asked.append((cell.name, poissons_ratio, resolution))
        if cell.name == "primitive-network":
            raise DensityError("too thin")
        return compute_table(
            cell,
            densities=(0.4, 0.6),
            poissons_ratio=poissons_ratio,
            resolution=resolution,
        )

    monkeypatch.setattr(module, "compute_table", compute)
    return asked


def test_tables_are_written_and_a_failure_stops_none(cli, quick, tmp_path) -> None:
    folder = tmp_path / "new" / "tables"
    ended = cli(
        "tabulate", "primitive-network", "gyroid-network", "gyroid-network",
        "-o", folder, "--resolution", "16", "--nu", "0.33", "--workers", "1",
    )  # fmt: skip
    assert ended.code == DensityError.exit_code
    assert "primitive-network: too thin" in ended.err
    assert "gyroid-network: 2 densities from 0.4 to 0.6" in ended.out
    assert quick == [("primitive-network", 0.33, 16), ("gyroid-network", 0.33, 16)]
    assert [path.name for path in folder.iterdir()] == ["gyroid-network.json"]
    table = read_property_table((folder / "gyroid-network.json").read_text(encoding="utf-8"))
    assert table.uncertainty is not None
    assert table.poissons_ratio == 0.33
    np.testing.assert_array_equal(table.resolution, 16)
    assert len(table.surfaces) == 2


def test_a_new_table_keeps_the_critical_stresses_of_the_one_it_replaces(tmp_path) -> None:
    file = resources.files("gradedesign_cells_strut.properties") / "octet.json"
    earlier = tmp_path / "octet.json"
    earlier.write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    old = read_property_table(earlier.read_text(encoding="utf-8"))
    new = replace(old, buckling=None, strength=1.1 * old.strength)
    kept = module.with_critical_stresses(new, earlier).buckling
    np.testing.assert_array_equal(kept.critical, old.buckling.critical)
    # Another cell, another material or other parameters have other ones.
    for other in (
        replace(new, family="sc"),
        replace(new, poissons_ratio=0.4),
        replace(new, parameters={"node_ratio": 1.2}),
    ):
        assert module.with_critical_stresses(other, earlier).buckling is None
    assert module.with_critical_stresses(new, tmp_path / "none.json") is new


def test_unknown_cells_are_refused_before_any_work(cli, quick, tmp_path) -> None:
    ended = cli("tabulate", "gyroid-network", "giroid-sheet", "-o", tmp_path)
    assert ended.code == 2
    assert "gyroid-sheet" in ended.err
    assert quick == []


def test_a_file_is_no_folder(cli, quick, tmp_path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    ended = cli("tabulate", "gyroid-network", "-o", tmp_path / "file")
    assert ended.code == 2
    assert "cannot make folder" in ended.err


def test_processes_without_dask_are_refused(cli, quick, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(on_dask, "find_spec", lambda _: None)
    words = ("tabulate", "gyroid-network", "primitive-network", "-o", tmp_path)
    ended = cli(*words, "--workers", "2")
    assert ended.code == 2
    assert "pip install distributed" in ended.err
    # Without asking for processes, one is enough.
    assert cli(*words, "--resolution", "16").code == DensityError.exit_code


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_answers_for_every_cell(cli, tmp_path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        ended = cli(
            "tabulate", "gyroid-network", "primitive-network",
            "-o", tmp_path, "--resolution", "15", "--scheduler", cluster.scheduler_address,
        )  # fmt: skip
    # An odd resolution is refused, by the workers: every cell's message comes back from them.
    assert ended.code == 6
    for name in ("gyroid-network", "primitive-network"):
        assert f"{name}: " in ended.err
    assert "internal error" not in ended.err


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_processes_of_this_machine_compute_the_same_tables(cli, tmp_path, monkeypatch) -> None:
    # Nothing compiled yet: the workers compile, which once failed for want of the same number of
    # threads as at their start.
    pytest.importorskip("distributed")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    names = ("gyroid-network", "primitive-network")
    for folder, workers in ((tmp_path / "two", "2"), (tmp_path / "one", "1")):
        ended = cli(
            "tabulate", *names, "-o", folder, "--resolution", "16", "--workers", workers
        )  # fmt: skip
        assert ended.code == 0, ended.err
        assert "INFO" not in ended.err
    for name in names:
        two, one = ((tmp_path / n / f"{name}.json").read_text() for n in ("two", "one"))
        assert two == one


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_no_cluster_at_an_address_is_told(cli, tmp_path) -> None:
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ended = cli(
        "tabulate", "gyroid-network", "-o", tmp_path, "--scheduler", f"tcp://127.0.0.1:{port}"
    )
    assert ended.code == 2
    assert "no dask cluster answers" in ended.err
