"""Fatigue limits: S-N curves by hand, the allowed stress of a pulled bar, refusals, hot spots."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.mechanics.explicit.measures import stress_measures
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.fatigue_curve import FatigueCurve
from gradedesign.mechanics.material.library import builtin_materials

#: Basquin's line by two points: a factor of 4 in stress over two decades.
CURVE = FatigueCurve(surface="as-built", ratio=-1, cycles=(1e4, 1e6), amplitude=(400.0, 100.0))
BAR = """
[case]
name = "bar"
[part]
box = ["40 mm", "10 mm", "10 mm"]
mesh_size = "5 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
youngs_modulus = "100 GPa"
poissons_ratio = 0.0
density = "4 g/cm^3"
yield_strength = "800 MPa"
[[material.fatigue]]
surface = "as-built"
ratio = -1
cycles = [1e4, 1e6]
amplitude = ["400 MPa", "100 MPa"]
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["10 kN", "0 N", "0 N"]}]
[[load_case]]
name = "push"
fix = [{region = "root"}]
load = [{region = "tip", force = ["-5 kN", "0 N", "0 N"]}]
[limits]
FATIGUE
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
[run]
stop_after = "solid"
[output]
formats = []
"""


@pytest.mark.parametrize(
    ("cycles", "ratio", "walker", "expected"),
    [
        # By hand: 400 (N / 1e4)^-0.30103, times (2 / (1 - R))^gamma.
        (1e4, -1.0, 0.5, 400.0),
        (1e5, -1.0, 0.5, 200.0),
        (1e5, 0.1, 0.5, 298.142397),
        (1e5, 0.1, 1.0, 444.444444),  # Amplitude alone: 2 * 200 / 0.9.
        (1e5, 0.1, 0.0, 200.0),  # Largest stress alone.
        (2e5, 0.5, 0.65, 200.0 * 2**-0.30103 * 4**0.65),
    ],
)
def test_the_largest_stress_that_is_borne_is_that_by_hand(cycles, ratio, walker, expected):
    curve = replace(CURVE, walker=walker)
    assert curve.largest_stress(cycles, ratio) == pytest.approx(expected, rel=1e-6)


def test_nothing_is_said_of_cycles_that_nobody_tested():
    for cycles in (9e3, 1.1e6):
        assert not CURVE.holds(cycles)
        with pytest.raises(ValueError, match=r"outside those of the S-N curve, as-built"):
            CURVE.largest_stress(cycles, -1)


@pytest.mark.parametrize(
    ("name", "surface", "specimens"),
    [
        # FatigueData-AM2022 no. 3: Cutolo et al. 2019, heat treated, MPa and cycles to failure.
        ("Ti-6Al-4V", "as-built",
         [(403.21, 14289), (368.10, 27333), (368.10, 37580), (309.02, 65344), (308.89, 67384),
          (308.98, 98600), (267.87, 263676), (267.87, 287957)]),
        # No. 21: Lai, Li and Ojha 2022, not heat treated.
        ("AlSi10Mg", "polished",
         [(175.05, 164501), (169.57, 449112), (159.74, 1303925), (165.27, 1843294),
          (155.14, 4732284), (145.27, 5306189), (139.61, 6040591), (170.14, 8792816)]),
    ],
)  # fmt: skip
def test_curves_of_the_library_are_lines_through_their_specimens(name, surface, specimens):
    material = next(m for m in builtin_materials() if m.name == name)
    curve = next(c for c in material.fatigue if c.surface == surface)
    stress, cycles = np.log10(np.array(specimens)).T
    slope, start = np.polyfit(stress, cycles, 1)  # ASTM E739: lives scatter, stresses do not.
    for n, amplitude in zip(curve.cycles, curve.amplitude, strict=True):
        assert amplitude == pytest.approx(10 ** ((math.log10(n) - start) / slope), rel=2e-3)
    assert "doi" in curve.source


def solid_rows(cli, home, limits):
    home.mkdir(exist_ok=True)
    (home / "case.toml").write_text(BAR.replace("FATIGUE", limits), encoding="utf-8")
    ended = cli("run", str(home), "-o", str(home / "r"), "--json")
    assert ended.code == 0, ended.err
    return json.loads((home / "r" / "result.json").read_text(encoding="utf-8"))


def test_a_pulled_bar_uses_what_basquin_and_walker_allow(cli, tmp_path):
    """10 kN on 100 mm^2 are 100 MPa; 298.142 MPa are borne, 198.762 allowed; push is another."""
    fatigue = (
        'stress = "400 MPa"\nfatigue = ['
        '{cycles = 1e5, ratio = 0.1, surface = "as-built", safety_factor = 1.5, '
        'load_case = "pull"}, '
        '{cycles = 1e6, ratio = -1, surface = "as-built", safety_factor = 2, load_case = "push"}]'
    )
    result = solid_rows(cli, tmp_path / "bar", fatigue)
    rows = {(row["name"], row["load_case"]): row for row in result["solid"]}
    assert set(rows) == {
        ("stress in solid part", "pull"),
        ("fatigue in solid part", "pull"),
        ("fatigue in solid part", "push"),
    }
    pull, push = (rows["fatigue in solid part", case] for case in ("pull", "push"))
    assert pull["limit"] == pytest.approx(298.142397 / 1.5, rel=1e-6)
    assert push["limit"] == pytest.approx(50.0, rel=1e-6)
    assert pull["value"] == pytest.approx(100.0, rel=1e-6)
    assert push["value"] == pytest.approx(50.0, rel=1e-6)
    assert pull["stated"] == "100000 cycles at R = 0.1, as-built"
    assert pull["measure"].endswith("at the largest load of the cycle")
    assert result["material"]["fatigue"][0]["amplitude_MPa"] == [400.0, 100.0]
    # 198.8 of 800 MPa, over 0.12, times 1.5; 50 of 800 MPa is less than any tested lattice bore.
    (told,) = [words for words in result["warnings"] if "no tests of these cells" in words]
    assert told.startswith("fatigue, 100000 cycles at R = 0.1, as-built: 25% of the yield strength")
    assert "bore 12% to 36%" in told
    assert "a safety_factor of 3.1 would allow 12%" in told


def test_a_bar_that_wears_out_is_infeasible(cli, tmp_path):
    fatigue = 'fatigue = [{cycles = 1e6, ratio = -1, surface = "as-built", safety_factor = 1.5}]'
    home = tmp_path / "bar"
    home.mkdir()
    (home / "case.toml").write_text(BAR.replace("FATIGUE", fatigue), encoding="utf-8")
    ended = cli("run", str(home), "-o", str(home / "r"))
    words = " ".join(ended.out.split())
    assert "already breaks a limit: fatigue in solid part (pull) is 99.5 MPa" in words
    # push bears 66.7 of the 50 MPa that it has.
    assert "1.49 times the allowed 66.67 MPa" in words


def test_a_hot_spot_is_named_with_its_place():
    stress = np.full((1000, 1), 50.0)
    stress[7] = 130.0
    points = np.random.default_rng(7).uniform(0.0, 10.0, (3, 1000))
    measures = stress_measures(
        points, np.ones(1000), stress, np.zeros(1000, dtype=np.int64), np.ones(1000, dtype=bool),
        limit=100.0, percentile=99.5, cells=20.0,
    )  # fmt: skip
    result = SimpleNamespace(measures={"pull": measures, "push": measures}, judged_share=1.0)
    once = StressLimit(
        key=LimitKey(kind="stress", region="lattice"), name="stress in lattice", allowed=100.0,
        percentile=99.5, evaluated=np.ones(1, dtype=bool),
    )  # fmt: skip
    often = replace(
        once, key=LimitKey(kind="fatigue", region="lattice", load_case="push"), cycle="1e6 cycles"
    )
    assert once.hot_spots(result) == replace(often, allowed=131.0).hot_spots(result) == ()
    (words,) = often.hot_spots(result)
    place = ", ".join(f"{c:.1f}" for c in points[:, 7])
    assert words.startswith(
        f"fatigue in lattice (push): a hot spot at ({place}) mm has 130 MPa at the largest load of "
        f"the cycle, more than the allowed 100 MPa (1e6 cycles)"
    )
    (row,) = often.rows(result, "test")
    assert (row.name, row.value, row.passed) == ("fatigue in lattice", 50.0, True)
