"""The exclusion radius: how much it leaves out, and the stress with it."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_parts import box_part, held_bar, zone_of

from gradedesign.design.resolve.exclusion import exclusion_data
from gradedesign.design.verdict.acceptance_data import stress_ratios
from gradedesign.mechanics.explicit.exclusion import exclusion_zone
from gradedesign.mechanics.explicit.measures import stress_measures
from gradedesign.mechanics.limits.local_stress import KIND, share_warnings

CASE = (
    held_bar(box_part(30, 10, 10, 5), name="block")
    + """\
[limits]
stress = "20 MPa"
exclusion_radius = "10 mm"
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = [0.2, 0.5]
"""
)


def test_share_and_stress_with_everything_are_measured_by_phase():
    rng = np.random.default_rng(811)
    x, volumes = rng.uniform(0, 40, 20_000), np.full(20_000, 0.5)
    phase = np.where(x < 4, 2, 0)  # kept up to 4 mm, wholly inside the radius
    evaluated = x > 10
    stress = np.where(x < 10, 90.0, 10.0)[:, None] * np.ones(4)
    stress[np.argmax((x > 5) & (x < 10)), 2] = 95.0
    zone = exclusion_zone(
        volumes, {"pull": stress}, phase, evaluated, zones=(zone_of(None, 10.0),), percentile=99.5
    )
    # By lengths: 6 of 36 mm of the lattice lie within 10 mm, and all 4 of what is kept.
    assert zone.share == {"lattice": pytest.approx(6 / 36, abs=0.01), "passive solid": 1.0}
    assert zone.everywhere == {"pull": {"lattice": 90.0, "passive solid": 90.0}}
    assert zone.maximum == {"pull": {"lattice": 95.0, "passive solid": 90.0}}
    (measure,) = stress_measures(
        np.stack([x, x, x]), volumes, stress, phase, evaluated, limit=50.0, percentile=99.5,
        cells=10.0,
    )  # fmt: skip
    assert (measure.phase, measure.value) == ("lattice", 10.0)
    assert exclusion_data(zone, {"lattice": 1.25}) == {
        "radius_mm": 10.0,
        "around": {"root": 10.0},
        "percentile": 99.5,
        "share_of_volume": zone.share,
        # On the basis of the limits' rows: of the lattice times what submodels found.
        "stress_ratio": {"lattice": 1.25},
        "stress_everywhere_MPa": {"pull": {"lattice": 112.5, "passive solid": 90.0}},
        "maximum_everywhere_MPa": {"pull": {"lattice": 118.75, "passive solid": 90.0}},
    }


@pytest.mark.parametrize("inside", [20.0, 0.1])
def test_the_stress_everywhere_is_never_below_the_judged_one(inside):
    """Also where the solid at the support has less stress than the rest."""
    rng = np.random.default_rng(5309)
    stress = rng.lognormal(3.0, 0.5, (8_000, 4))
    points, volumes = rng.uniform(0, 40, (3, 8_000)), rng.uniform(0.1, 1.0, 8_000)
    phase, evaluated = np.zeros(8_000, dtype=int), points[0] > 10
    stress[~evaluated] *= inside
    (measure,) = stress_measures(
        points, volumes, stress, phase, evaluated, limit=50.0, percentile=99.5, cells=10.0
    )
    zone = exclusion_zone(
        volumes, {"pull": stress}, phase, evaluated, zones=(zone_of(None, 10.0),), percentile=99.5
    )
    everywhere = zone.everywhere["pull"]["lattice"]
    # As much volume lies above it as above the judged one: less than one sample's is the error.
    above = np.repeat(volumes / 4, 4)[stress.ravel() > everywhere].sum()
    assert above == pytest.approx(0.005 * measure.volume, abs=volumes.max() / 4)
    assert everywhere >= measure.value if inside > 1 else everywhere == measure.value


def test_the_ratio_is_that_of_the_row_over_its_analysis():
    """Submodels raise the lattice by a tenth; a phase that no row limits has no ratio."""

    def measure(phase, value):
        return SimpleNamespace(phase=phase, value=value)

    result = SimpleNamespace(
        measures={"pull": (measure("lattice", 40.0), measure("skin", 9.0)),
                  "side": (measure("lattice", 20.0), measure("passive solid", 0.0))}
    )  # fmt: skip
    rows = [
        SimpleNamespace(phase="lattice", load_case="pull", value=44.0),
        SimpleNamespace(phase="passive solid", load_case="side", value=0.0),
        SimpleNamespace(phase="", load_case="pull", value=0.1),
    ]
    assert stress_ratios(rows, result) == {
        "lattice": pytest.approx(1.1), "passive solid": 1.0
    }  # fmt: skip


def test_share_of_the_part_counts_where_lattice_is():
    """Of 5 mm^3 of lattice 2 lie within the radius, beside a solid element there."""
    placed = SimpleNamespace(
        members=False,
        cells=True,
        material=None,
        law=SimpleNamespace(laws=(SimpleNamespace(local_stress=None),)),
        lattice_volumes=np.array([0.0, 2.0, 3.0]),
        evaluated=np.array([False, False, True]),
        exclusion_radius=5.0,
    )
    limits = SimpleNamespace(safety_factor=None, stress=9.0, percentile=99)
    (limit,), (warning,) = KIND.make(limits, placed)
    assert (limit.allowed, limit.percentile) == (9.0, 99)
    assert "leaves 40% of the latticed region out" in warning
    assert share_warnings(0.0, 5.0) == ()


@pytest.mark.parametrize(
    ("swap", "warned"),
    [
        (("", ""), True),  # a third of the block lies within 10 mm
        (('"10 mm"\n[lattice]', '"5 mm"\n[lattice]'), False),
        (('stress = "20 MPa"\n', 'displacement = [{region = "tip", magnitude = "9 mm"}]\n'), False),
    ],
)
def test_a_radius_that_leaves_out_much_is_said(cli, tmp_path, swap, warned):
    assert swap[0] in CASE
    (tmp_path / "case.toml").write_text(CASE.replace(*swap), encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture")
    assert ended.code == 0
    assert ("exclusion radius of 10 mm around supports leaves 3" in ended.out) == warned
