"""S-N curves: through their points, falling, reversible by ratio, and read as they are written."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from gradedesign.mechanics.material.fatigue_curve import FatigueCurve
from gradedesign.mechanics.material.material_schema import FatigueCurveSpec

RATIOS = st.floats(-1.0, 0.95)


@st.composite
def curves(draw):
    """Curves of two to five points, stresses in tenths of an MPa."""
    count = draw(st.integers(2, 5))
    cycles = draw(st.lists(st.integers(1, 10**9), min_size=count, max_size=count, unique=True))
    tenths = draw(st.lists(st.integers(10, 20_000), min_size=count, max_size=count))
    return FatigueCurve(
        surface="s",
        ratio=draw(RATIOS),
        cycles=tuple(float(n) for n in sorted(cycles)),
        amplitude=tuple(s / 10.0 for s in sorted(tenths, reverse=True)),
        walker=draw(st.floats(0.0, 1.0)),
    )


@given(curves(), RATIOS, RATIOS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_cycles_bear_less_and_a_larger_ratio_more(curve, one, other, early, late):
    first, last = curve.cycles[0], curve.cycles[-1]
    few, many = (first + share * (last - first) for share in sorted((early, late)))
    assert curve.largest_stress(few, one) >= curve.largest_stress(many, one) * (1 - 1e-12)
    low, high = sorted((one, other))
    at_low, at_high = (curve.largest_stress(few, ratio) for ratio in (low, high))
    assert at_low <= at_high * (1 + 1e-12)
    # Its amplitude falls, or stays where only amplitudes count.
    assert at_high * (1 - high) <= at_low * (1 - low) * (1 + 1e-12)


@given(curves(), RATIOS)
def test_points_are_met_and_a_ratio_leads_back(curve, ratio):
    for cycles, amplitude in zip(curve.cycles, curve.amplitude, strict=True):
        largest = 2.0 * amplitude / (1.0 - curve.ratio)
        assert curve.largest_stress(cycles, curve.ratio) == pytest.approx(largest, rel=1e-12)
        there = curve.largest_stress(cycles, ratio)
        amplitude_there = there * (1.0 - ratio) / 2.0
        ends = (curve.cycles[0], curve.cycles[-1])
        turned = FatigueCurve(
            surface="s", ratio=ratio, cycles=ends, amplitude=(amplitude_there,) * 2,
            walker=curve.walker,
        )  # fmt: skip
        assert turned.largest_stress(cycles, curve.ratio) == pytest.approx(largest, rel=1e-12)


@given(curves())
def test_a_curve_is_read_as_it_is_written(curve):
    written = {
        "surface": curve.surface,
        "ratio": curve.ratio,
        "cycles": list(curve.cycles),
        "amplitude": [f"{s!r} MPa" for s in curve.amplitude],
        "walker": curve.walker,
    }
    assert FatigueCurveSpec.model_validate(written).curve() == curve


@given(curves(), st.data())
def test_points_out_of_order_are_refused(curve, data):
    at = data.draw(st.integers(0, len(curve.cycles) - 2))
    cycles, amplitude = list(curve.cycles), [f"{s!r} MPa" for s in curve.amplitude]
    cycles[at], cycles[at + 1] = cycles[at + 1], cycles[at]
    with pytest.raises(ValidationError, match="expected rising ones"):
        FatigueCurveSpec(surface="s", ratio=-1.0, cycles=cycles, amplitude=amplitude)
    amplitude[at + 1] = f"{curve.amplitude[at] + 0.1!r} MPa"
    with pytest.raises(ValidationError, match="expected none above the one before"):
        FatigueCurveSpec(surface="s", ratio=-1.0, cycles=list(curve.cycles), amplitude=amplitude)
