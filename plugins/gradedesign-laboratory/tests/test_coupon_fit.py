"""What coupons say of a process: intervals that hold the truth, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from gradedesign import CaseError, LawOrigin, Material, Process, power_law
from gradedesign.design.printing.as_built import as_built_surface, building_on
from gradedesign_laboratory.coupon_fit import Estimate, RatioFit, fit_ratio, fit_struts
from gradedesign_laboratory.coupon_record import process_table, record_text
from gradedesign_laboratory.coupon_shapes import strut_coupon
from gradedesign_laboratory.coupon_sheet import PlateFacts
from gradedesign_laboratory.coupons import Struts
from gradedesign_laboratory.fitted_coupons import fit_coupons
from gradedesign_laboratory.measured_coupons import MeasuredBlock, MeasuredStrut, Readings

METAL = Material(
    name="metal", youngs_modulus=110e3, poissons_ratio=0.3, density=4.4e-9, yield_strength=800.0
)
LAW = power_law(
    "test", ("octet",), youngs=(0.4, 1.3), strength=(0.5, 1.4), window=(0.05, 0.8),
    origin=LawOrigin(kind="stated", source="test", test="none"),
)  # fmt: skip
#: Truth of the sheets that are made, by the name of the estimate.
SIZES, SCATTER, MODULUS, YIELD, GAUGE = (
    {0.0: 0.11, 45.0: 0.06, 90.0: -0.01},
    0.025,
    0.84,
    0.93,
    0.01,
)
TRUTH = {**{f"size {a:g}": d for a, d in SIZES.items()}, "scatter": SCATTER}
TRUTH |= {"modulus": MODULUS, "yield": YIELD}


def made_readings(seed, gauge=GAUGE):
    """A sheet by normal widths and log-normal tests about the truth; masses with 0.5 % of noise."""
    rng = np.random.default_rng(seed)
    struts = [
        MeasuredStrut(
            coupon=10 + k, strut=n, inclination=a, designed=w,
            width=w + d + rng.normal(0.0, SCATTER) + rng.normal(0.0, GAUGE),
        )
        for k, ((a, d), w) in enumerate((pair, w) for pair in SIZES.items() for w in (0.5, 1.0))
        for n in range(1, 6)
    ]  # fmt: skip
    blocks = []
    for number, density in enumerate(np.repeat([0.2, 0.3, 0.4], 3), start=1):
        rho, plates, ratio = density * 1.07, 380.0, 1.1
        solid = plates + rho * 16.0**3
        blocks.append(
            MeasuredBlock(
                coupon=number, density=float(density), size=4.0, cells=4,
                designed=plates + density * 16.0**3, plates=plates, ratio=ratio,
                edges=(None, None, None),
                mass=solid * 4.4e-3 * (1.0 + rng.normal(0.0, 0.005)),
                modulus=MODULUS * ratio * 110e3 * 0.4 * rho**1.3 * np.exp(rng.normal(0.0, 0.06)),
                strength=YIELD * 800.0 * 0.5 * rho**1.4 * np.exp(rng.normal(0.0, 0.05)),
            )
        )  # fmt: skip
    return Readings(
        facts=PlateFacts(process="test", material="metal", cell="octet"), machine="M", gauge=gauge,
        day="2026-11-27", struts=tuple(struts), blocks=tuple(blocks),
    )  # fmt: skip


def estimates(fit):
    found = {f"size {a:g}": size for a, size in fit.struts.sizes.items()}
    return {
        **found, "scatter": fit.struts.scatter, "modulus": fit.modulus.estimate,
        "yield": fit.strength.estimate,
    }  # fmt: skip


def covered(truth, seeds):
    """Seeds of each quantity whose interval holds the truth."""
    count = dict.fromkeys(truth, 0)
    for seed in seeds:
        for name, one in estimates(fit_coupons(made_readings(seed), METAL, LAW)).items():
            count[name] += one.low <= truth[name] <= one.high
    return count


def test_intervals_hold_the_truth_of_95_sheets_in_100():
    """Of 1000 sheets the count is binomial: within its 99.9 % range of 950, so neither too few
    nor, by intervals too wide to tell anything, too many; 100 sheets alone give 95 or more in 62 of
    100 tries where the interval is exact.
    """
    seeds = range(3000, 4000)
    count = covered(TRUTH, seeds)
    low, high = stats.binom.ppf([0.0005, 0.9995], len(seeds), 0.95)
    assert all(low <= n <= high for n in count.values()), count
    # All quantities and sheets together: 0.95 within three standard errors.
    share = sum(count.values()) / (len(seeds) * len(TRUTH))
    assert share == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / (len(seeds) * len(TRUTH))))
    # A truth that is off by what the noise hides least is told: 4 % of a modulus known to 2 %.
    wrong = covered({**TRUTH, "modulus": 1.04 * MODULUS, "size 45": 0.07}, range(3000, 3200))
    assert wrong["modulus"] < 150
    assert wrong["size 45"] < 180


def test_without_a_gauge_its_error_is_part_of_the_scatter():
    stated = fit_coupons(made_readings(11), METAL, LAW).struts
    blank = fit_coupons(made_readings(11, gauge=None), METAL, LAW).struts
    assert blank.scatter.value**2 == pytest.approx(stated.scatter.value**2 + GAUGE**2)
    assert "gauge_mm is blank" in blank.notes[-1]
    assert not stated.notes


def test_a_gauge_worse_than_the_struts_is_refused():
    fit = fit_struts(made_readings(11).struts, 0.2)
    assert fit.scatter is None
    assert "less than gauge_mm alone" in fit.refused[0]
    near = fit_struts(made_readings(11).struts, 0.028)
    assert near.scatter is None
    assert "not told from the error of the gauge; below" in near.refused[0]


def without(readings, keep):
    """The same sheet, with widths of struts blank unless they are kept."""
    struts = tuple(s if keep(s) else replace(s, width=None) for s in readings.struts)
    return replace(readings, struts=struts)


def test_what_has_too_few_measurements_is_refused_by_name():
    readings = made_readings(11)
    two = without(readings, lambda s: s.inclination != 45.0 or s.strut == 1)
    fit = fit_coupons(two, METAL, LAW)
    assert list(fit.struts.sizes) == [0.0, 90.0]
    assert fit.refused == ("strut size at 45 deg: 2 struts measured, expected at least 3",)
    assert [pair[0] for pair in process_table(fit)["strut_size"]] == ["0 deg", "90 deg"]
    one = fit_coupons(without(readings, lambda s: s.inclination == 0.0), METAL, LAW)
    assert not one.struts.sizes
    assert one.struts.scatter is None
    assert "strut size and scatter: 1 inclinations with 3 struts each" in one.refused[-1]
    assert set(process_table(one)) == {"stiffness", "material", "machine", "samples", "source"}
    few = replace(readings, blocks=readings.blocks[:2])
    fit = fit_coupons(few, METAL, LAW)
    assert fit.modulus.estimate is None
    assert fit.refused == (
        "modulus: 2 blocks with mass and modulus, expected at least 3",
        "yield: 2 blocks with mass and yield, expected at least 3",
    )
    assert "stiffness" not in process_table(fit)
    nothing = replace(without(readings, lambda _: False), blocks=())
    with pytest.raises(CaseError, match="no record can be made") as error:
        record_text(fit_coupons(nothing, METAL, LAW))
    assert "strut size at 90 deg: 0 struts measured" in str(error.value)


def test_blocks_are_compared_at_the_density_that_was_weighed():
    """By the designed density, 7 % less, the modulus would look 1.07^1.3 times as large."""
    readings = made_readings(11)
    exact = [
        replace(b, mass=(b.plates + 1.07 * b.density * 16.0**3) * 4.4e-3,
                modulus=0.84 * 1.1 * 110e3 * 0.4 * (1.07 * b.density) ** 1.3)
        for b in readings.blocks
    ]  # fmt: skip
    fit = fit_coupons(replace(readings, blocks=tuple(exact)), METAL, LAW)
    one = fit.modulus.estimate
    np.testing.assert_allclose([one.value, one.low, one.high], 0.84, rtol=1e-9)
    unweighed = [replace(exact[0], mass=None), *exact[1:]]
    fit = fit_coupons(replace(readings, blocks=tuple(unweighed)), METAL, LAW)
    assert fit.modulus.estimate.count == 8
    assert "coupon 1: not weighed" in fit.refused[0]
    heavy = [replace(exact[0], mass=exact[0].mass * 4.0), *exact[1:]]
    fit = fit_coupons(replace(readings, blocks=tuple(heavy)), METAL, LAW)
    assert fit.modulus.estimate.count == 8
    assert "coupon 1: weighed density" in fit.refused[0]


def test_units_that_are_wrong_by_a_thousand_are_told():
    readings = made_readings(11)
    wrong = [replace(readings.blocks[0], modulus=readings.blocks[0].modulus / 1e3)]
    with pytest.raises(CaseError, match=r"coupon 1: modulus_MPa is 0\.000\d+ times the nominal"):
        fit_coupons(replace(readings, blocks=(*wrong, *readings.blocks[1:])), METAL, LAW)
    stiff = [replace(b, modulus=b.modulus * 2.5) for b in readings.blocks]
    fit = fit_coupons(replace(readings, blocks=tuple(stiff)), METAL, LAW)
    assert fit.modulus.estimate is None
    assert "times nominal, expected at most 1.5" in fit.refused[-1]


def test_groups_that_differ_are_noted():
    readings = made_readings(11)
    struts = [
        replace(s, width=s.width + (0.15 if s.designed > 0.6 else 0.0)) for s in readings.struts
    ]
    notes = fit_struts(struts, GAUGE).notes
    assert [note.split(" change")[0] for note in notes] == [
        "struts of 0 deg", "struts of 45 deg", "struts of 90 deg",
    ]  # fmt: skip
    ratios = fit_ratio("modulus", [0.8, 0.81, 0.79, 0.95, 0.96, 0.94], [0.2] * 3 + [0.4] * 3)
    assert "changes with the density (0.2: +0.8, 0.4: +0.95)" in ratios.notes[0]


def test_a_median_ratio_is_that_of_logarithms():
    """Student's interval of three logarithms, by hand: t = 4.3027 with two degrees of freedom."""
    fit = fit_ratio("modulus", [0.5, 1.0, 2.0], [0.3, 0.3, 0.3])
    half = 4.302652729911275 * np.log(2.0) / np.sqrt(3.0)
    assert fit == RatioFit(
        estimate=Estimate(
            value=pytest.approx(1.0), low=pytest.approx(np.exp(-half)),
            high=pytest.approx(np.exp(half)), count=3,
        )
    )  # fmt: skip


def built_widths(inclination, process):
    """Mean widths of the struts of a coupon as the process builds it, at their free ends."""
    coupon = Struts(number=1, inclination=inclination, width=0.8, count=3)
    surface = strut_coupon(coupon)
    held = np.zeros(len(surface.faces), dtype=bool)
    building = building_on(surface, process, np.array([0.0, 0.0, 1.0]), held, 2.0)
    built = as_built_surface(surface, building, 271)
    angle = np.radians(inclination)
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    far = surface.vertices @ along
    ends = np.flatnonzero(far > far.max() - 1e-6)
    middle = np.sort(np.unique(surface.vertices[ends, 1].round(6)))
    found = []
    for low in np.linspace(middle[0], middle[-1] - 0.8, 3):
        own = ends[np.abs(surface.vertices[ends, 1] - low - 0.4) < 0.5]
        centre = surface.vertices[own].mean(axis=0)
        off = built.vertices[own] - centre
        radii = np.linalg.norm(off - np.outer(off @ along, along), axis=1)
        # Corners of 96 facets lie farther out than a circle of the same area.
        found.append(2.0 * radii.mean() * np.sqrt(np.sin(2 * np.pi / 96) * 96 / (2 * np.pi)))
    return found


def test_what_a_process_builds_of_the_coupons_is_read_back_as_its_table():
    """The plate, the as-built body and the fit agree on what a strut's size and inclination are."""
    table = ((0.0, 0.12), (90.0, 0.02))
    process = Process(name="known", strut_size=table)
    struts = [
        MeasuredStrut(coupon=k, strut=n, inclination=a, designed=0.8, width=w)
        for k, a in enumerate((30.0, 60.0, 90.0), start=1)
        for n, w in enumerate(built_widths(a, process), start=1)
    ]
    sizes = fit_struts(struts, None).sizes
    for inclination, size in sizes.items():
        # Linear in the cosine; averaging over neighbouring facets and their number leave microns.
        expected = 0.02 + 0.1 * np.cos(np.radians(inclination))
        assert size.value == pytest.approx(expected, abs=2e-3)
