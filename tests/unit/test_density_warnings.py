"""What ``generate`` says where the printed density is off the stated one."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.design.case.read_case import load_case
from gradedesign.design.verdict.density_warnings import BesideCells, density_warnings
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.slab_density import SlabDensities
from gradedesign.program.outputs import drawn_files

CASE = """\
[case]
name = "block"
[part]
box = ["24 mm", "12 mm", "12 mm"]
[lattice]
cell = "sc"
size = "6 mm"
density = 0.2
[output]
formats = ["stl"]
"""
ROD = '[[keep]]\ncylinder = {diameter = "4 mm", point = ["0 mm", "6 mm", "6 mm"], axis = "x"}\n'


@pytest.mark.parametrize("kept", ["", ROD], ids=["lattice alone", "rod along struts"])
def test_a_rod_along_struts_is_told_to_take_their_density(kept, tmp_path, cli, monkeypatch):
    monkeypatch.setattr(drawn_files, "picture_lattice", lambda *_, **__: ())
    (tmp_path / "case.toml").write_text(CASE + kept, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    density = result["measures"]["density"]
    told = [text for text in result["warnings"] if "printed density" in text]
    if not kept:
        assert density["surface"] == pytest.approx(0.2, rel=0.01)
        assert told == []
        return
    rod = np.pi * 2**2 / 12**2
    assert density["target"] == pytest.approx(0.2 + 0.8 * rod, abs=1e-3)
    # The strut along the rod, and at each of four nodes four more from it to the rod's face, are
    # inside it; what the ends of those lose to the round strut is a tenth of them.
    strut = np.pi * (result["measures"]["cell"]["thinnest_wall_mm"] / 2) ** 2
    inside = (24 * strut + 16 * strut * (2 - np.sqrt(strut / np.pi))) / (24 * 12**2)
    assert density["surface"] == pytest.approx(0.2 + rod - inside, abs=0.15 * inside / 2)
    (words,) = told
    assert words.startswith("case.toml:8: lattice.density: the printed density of the ")
    missed = density["surface"] / density["target"] - 1
    assert f"is {density['surface']:.4f} where {density['target']:.4f} is stated, with" in words
    assert f"{missed:+.1%} off and more than 1%: " in words
    assert "% since solid regions, skins" in words
    assert "the grid" not in words
    assert "another [lattice] origin" in words


def slabs_of(target, field, surface, measured_on="surface"):
    """One slab across each axis of which all targets are the same, or one for each axis."""
    targets = np.broadcast_to(target, 3)
    return [
        SlabDensities(
            axis=axis, edges=np.array([0.0, 6.0]), part_volume=np.array([216.0]),
            target=np.array([targets[axis]]), field=np.array([field]),
            surface=np.array([surface]), measured_on=measured_on,
        )
        for axis in range(3)
    ]  # fmt: skip


def told(folder, slabs, *, period=1, more="", wall=0.036, loose=0.0, joints=0.0):
    (folder / "case.toml").write_text(CASE + more, encoding="utf-8")
    domain = DesignDomain(
        distance=lambda points: points[0], lower=np.zeros(3), upper=np.full(3, 6.0)
    )
    stated = SimpleNamespace(
        case=load_case(folder / "case.toml"),
        cells=SimpleNamespace(period=period),
        design=SimpleNamespace(domain=domain),
        wall=wall,
    )
    return density_warnings(stated, slabs, BesideCells(loose=loose, joints=joints))


@pytest.mark.parametrize(
    ("slabs", "also", "cause"),
    [
        # Sheets of 0.036 mm on a grid of 0.063 mm; points find the field within 0.001.
        (slabs_of(0.05, 0.0495, 0.0494), {}, "walls of 0.036 mm lie between the nodes"),
        # Walls of 0.2 mm are drawn right: the points do not find 0.0006.
        (slabs_of(0.05, 0.05, 0.0494), {"wall": 0.2}, "faces of the part cut cells"),
        (slabs_of(0.05, 0.05, 0.0494), {}, "walls of 0.036 mm lie between the nodes of the grid"),
        (slabs_of(0.05, 0.05, 0.0494, "layers"), {}, "layers and pixels are too coarse"),
        (
            slabs_of(0.05, 0.05, 0.0494),
            {"more": '[print]\nchord_tolerance = "0.02 mm"\n'},
            "triangles were merged within",
        ),
        (slabs_of(0.2, 0.19, 0.19), {}, "faces of the part cut cells"),
        (slabs_of(0.2, 0.21, 0.21), {}, "faces of the part cut cells"),
        (
            slabs_of(0.2, 0.19, 0.19),
            {"period": 4},
            "the cells are random and repeat after 4 of them",
        ),
        (slabs_of(0.2, 0.2, 0.19), {"loose": 0.01}, "disconnected components"),
        (slabs_of(0.2, 0.21, 0.21), {"joints": 0.01}, "joints and net-skins add"),
    ],
)
def test_the_cause_of_a_miss_is_told(slabs, also, cause, tmp_path):
    (words,) = told(tmp_path, slabs, **also)
    missed = slabs[0].surface[0] / slabs[0].target[0] - 1
    assert f"{missed:+.1%} since {cause}" in words
    assert words.count(" since ") == 1


def test_two_causes_are_told_with_their_shares_the_larger_first(tmp_path):
    (words,) = told(tmp_path, slabs_of(0.05, 0.05, 0.0485), loose=0.001)
    first, second = words.index("-2.0% since disconnected"), words.index("-1.0% since walls")
    assert first < second


@pytest.mark.parametrize(
    ("slabs", "count"),
    [
        (slabs_of(0.2, 0.2, 0.2019), 0),
        (slabs_of(0.2, 0.2, 0.2021), 1),
        # Sampled targets that differ are not known better than that.
        (slabs_of((0.199, 0.2, 0.201), 0.2, 0.2021), 0),
        (slabs_of((0.199, 0.2, 0.201), 0.2, 0.2041), 1),
    ],
)
def test_a_miss_is_told_beyond_one_per_cent_and_the_sampling(slabs, count, tmp_path):
    assert len(told(tmp_path, slabs)) == count
