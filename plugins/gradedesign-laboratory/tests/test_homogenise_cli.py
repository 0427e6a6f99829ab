"""`gradedesign homogenise`: its data, its tables, its files and its refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gradedesign_laboratory import run_homogenise as module
from gradedesign_laboratory.critical_stress import CriticalStress

WORDS = ("homogenise", "gyroid-network", "--density", "0.5", "--resolution", "16")


def test_json_gives_the_stiffness_and_what_follows(cli) -> None:
    ended = cli(*WORDS, "--conductivity", "--json")
    assert ended.code == 0
    data = json.loads(ended.out)
    c = np.array(data["C"])
    assert data["voigt_order"] == ["xx", "yy", "zz", "yz", "xz", "xy"]
    # Half of the table that ships: 0.2088 at 0.5, both within the error that is stated.
    assert 1 / np.linalg.inv(c)[0, 0] == pytest.approx(data["engineering"]["E"]["x"], rel=1e-5)
    assert np.array(data["C_uncertainty"]).max() < 0.05 * c.max()
    shipped = {law["name"]: law["E_x"] for law in data["laws"]}["gyroid-network-computed"]
    assert data["engineering"]["E"]["x"] == pytest.approx(shipped, rel=0.03)
    assert data["stiffness_error"] < data["energy_error"] < 0.1
    c44 = data["C_uncertainty"][3][3] / data["C"][3][3]
    assert data["constant_errors"]["C44"] == pytest.approx(c44, rel=0.05)
    assert list(data["constant_errors"]) == ["C11", "C12", "C44"]
    assert data["youngs"]["100"] == data["engineering"]["E"]["x"]
    assert data["youngs"]["least"] <= data["youngs"]["110"] <= data["youngs"]["greatest"]
    assert len(data["bounds"]) == 8
    assert all(bound["holds"] for bound in data["bounds"])
    assert len(data["strength"]["factors"]) == 14
    assert data["averages"]["bulk"]["hill"] == pytest.approx((c[0, 0] + 2 * c[0, 1]) / 3, rel=1e-5)
    assert "surface" not in data["strength"]
    # A network lies below the bound of a sheet, 2 rho / (3 - rho); a third of rho at least.
    conductivity = np.array(data["conductivity"]["value"])
    assert data["conductivity"]["isotropic_bound"] == pytest.approx(0.4)
    assert 0.25 < conductivity[0, 0] < 0.4
    np.testing.assert_allclose(conductivity, conductivity[0, 0] * np.eye(3), atol=2e-3)


def test_with_a_folder_it_draws_and_prints_tables(cli, tmp_path) -> None:
    folder = tmp_path / "new" / "folder"
    ended = cli(*WORDS, "--nu", "0.25", "-o", folder)
    assert ended.code == 0
    for words in (
        "Stiffness C",
        "Zener ratio",
        "holds",
        "hydrostatic",
        "strength surface",
        "wrote",
    ):
        assert words in ended.out
    assert "BROKEN" not in ended.out
    for name in ("stiffness.png", "laws.png", "strength.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    stored = json.loads((folder / "properties.json").read_text(encoding="utf-8"))
    assert stored["poissons_ratio"] == 0.25
    assert stored["strength"]["surface"]["max_error"] < 0.2


def test_buckling_is_computed_on_voxels_of_its_own(cli, monkeypatch) -> None:
    asked = []

    def critical(cell, rho, *, poissons_ratio, solver):
        asked.append((cell.name, dict(cell.parameters), rho, poissons_ratio, solver.name))
        return CriticalStress(
            density=rho,
            resolution=32,
            wall_voxels=4.0,
            critical=np.arange(1.0, 13.0).reshape(6, 2) / 1000,
            cells=np.array([[2, 0], [2, 0], [2, 0], [1, 1], [1, 1], [1, 1]]),
            error=0.12,
        )

    monkeypatch.setattr(module, "critical_stress", critical)
    found = json.loads(cli(*WORDS, "--nu", "0.25", "--buckling", "--json").out)["buckling"]
    assert asked == [("gyroid-network", {}, 0.5, 0.25, "lanczos")]
    row = found["critical"][0]
    # Stretched along x there is no long wave; pressed, C44 bears it, less the work on swaying;
    # oblique waves resist 1 % less here.
    pressed, none = row.pop("long_waves")
    c = json.loads(cli(*WORDS, "--nu", "0.25", "--json").out)["C"]
    assert none is None
    assert 0.98 < pressed / (c[3][3] / 1.1) <= 1.0005
    assert row == {"component": "xx", "negative": 0.001, "positive": 0.002, "cells": [2, 0]}
    assert (found["resolution"], found["error"]) == (32, 0.12)
    text = " ".join(cli(*WORDS, "--buckling").out.split())
    assert "0.1000 (repeats after 2 cells) 0.2000 or more" in text
    assert "1.1000 (repeats in every cell)" in text
    assert "up to 12% by extrapolation" in text


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("gyroid-netwrk", "--density", "0.3"), 2, "gyroid-network"),
        (("gyroid-network", "--density", "1.3"), 6, "exists for relative densities"),
        (("gyroid-network", "--density", "0.3", "--resolution", "33"), 6, "even number"),
        (("gyroid-sheet", "--density", "0.1", "--resolution", "32"), 6, "take resolution"),
        (("gyroid-network", "--density", "0.3", "--parameter", "x=1"), 2, "has no parameter x"),
        (("gyroid-network", "--density", "0.3", "--parameter", "x"), 2, "name=number"),
        (
            ("gyroid-network", "--density", "0.3", "--parameter", "a=1", "--parameter", "a=2"),
            2,
            "given twice",
        ),
        (("gyroid-network", "--density", "0.5", "--resolution", "16", "--nu", "0.5"), 6, "0.5"),
    ],
)
def test_impossible_requests_are_refused(cli, words, code, message) -> None:
    ended = cli("homogenise", *words)
    assert ended.code == code
    assert message in ended.err
    assert "Traceback" not in ended.err


BLOCK = ("homogenise", "primitive-network", "--density", "0.5", "--resolution", "16")


def block(cli, boundary, cells=1):
    ended = cli(*BLOCK, "--boundary", boundary, "--cells", cells, "--json")
    assert ended.code == 0, ended.err
    data = json.loads(ended.out)
    assert (data["boundary"], data["cells"]) == (boundary, cells)
    return data, np.array(data["C"]), np.array(data["periodic"]["C"])


def test_traction_lies_below_periodic_below_displacement(cli) -> None:
    """In the sense of energies: Hazanov and Huet 1994; more cells draw both closer."""
    above, upper, periodic = block(cli, "displacement")
    below, lower, filled = block(cli, "traction")
    assert np.linalg.eigvalsh(upper - periodic)[0] > -1e-6
    assert np.linalg.eigvalsh(filled - lower)[0] > -1e-6
    # Its void carries a little, in both: otherwise a boundary that cuts void carries nothing.
    assert (below["void_stiffness"], above["void_stiffness"]) == (1e-3, 0.0)
    assert above["in_order"]
    assert below["in_order"]
    # Far apart, so that an exchange of the two would be seen: 1.1 and 0.02 of the energy.
    assert above["energy_over_periodic"][0] > 1.05
    assert below["energy_over_periodic"][1] < 0.1
    assert block(cli, "displacement", 2)[0]["energy_over_periodic"][1] < 1.4
    assert above["energy_over_periodic"][1] > 1.6


def test_mixed_conditions_of_a_cell_between_mirrors_give_its_periodic_stiffness(cli) -> None:
    """Pahr and Zysset 2008: exact for this cell, and nothing is proved of others."""
    data, mixed, periodic = block(cli, "mixed")
    np.testing.assert_allclose(mixed, periodic, atol=1e-4 * periodic[0, 0])
    assert data["in_order"] is None
    assert "in_order" in data


def test_a_macro_tetrahedron_falls_towards_the_periodic_stiffness(cli) -> None:
    one, c1, periodic = block(cli, "macro-tet", 1)
    two, c2, _ = block(cli, "macro-tet", 2)
    assert np.linalg.eigvalsh(c1 - c2)[0] > 0
    assert np.linalg.eigvalsh(c2 - periodic)[0] > 0
    # It is no whole number of cells, so it holds another share of solid than they do.
    assert abs(two["solid_volume_fraction"] - 0.5) < abs(one["solid_volume_fraction"] - 0.5) < 0.3


def test_a_block_is_printed_beside_the_periodic_lattice(cli) -> None:
    ended = cli(*BLOCK, "--boundary", "displacement")
    assert ended.code == 0
    for words in ("boundary displacement on 1^3 cells", "Stiffness C of the periodic", "as proved"):
        assert words in " ".join(ended.out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--boundary", "tracton"), 'did you mean "traction"'),
        (("--boundary", "mixed", "--buckling"), "--buckling need --boundary periodic"),
        (("--boundary", "mixed", "--cells", "20"), "320 voxels along the block, at most 256"),
        (("--cells", "2"), "does not go with --boundary periodic"),
    ],
)
def test_what_a_block_cannot_do_is_refused(cli, words, said) -> None:
    ended = cli(*BLOCK, *words)
    assert ended.code in (2, 5)
    assert said in ended.err
