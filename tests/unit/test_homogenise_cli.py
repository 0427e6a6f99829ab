"""`gradedesign homogenise`: its data, its tables, its files and its refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gradedesign.cli import homogenise as module
from gradedesign.homogenise.critical_stress import CriticalStress

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

    def critical(family, parameters, rho, *, poissons_ratio):
        asked.append((family.name, parameters, rho, poissons_ratio))
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
    assert asked == [("gyroid-network", {}, 0.5, 0.25)]
    assert found["critical"][0] == {
        "component": "xx", "negative": 0.001, "positive": 0.002, "cells": [2, 0]
    }  # fmt: skip
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
