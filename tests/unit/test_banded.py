"""Bands from two or three resolutions, by hand."""

from dataclasses import asdict, replace

import pytest

from gradedesign.errors import CaseError
from gradedesign.mechanics.limits.banded import Banded, Residual, banded, observed_order
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow, row_from_json

ORDERS = (0.75, 1.5, 3.0)


def shares(*rises):
    """Residuals that only rise, as those of the work of the loads."""
    return [Residual(rise=rise) for rise in rises]


def test_an_assumed_range_of_orders_gives_both_ends():
    # 10 - h^p from h = 2 and 1 reads 9 at h = 1; extrapolated with the order p it reads 10.
    for order in ORDERS:
        found = banded([(2.0, 10.0 - 2.0**order), (1.0, 9.0)], ORDERS)
        assert found.low == 9.0  # the fine value itself stays in the band
        assert found.low <= 10.0 <= found.high + 1e-12
        assert found.order == "assumed"
    middle = banded([(2.0, 10.0 - 2.0**1.5), (1.0, 9.0)], ORDERS)
    assert middle.value == pytest.approx(10.0)
    # From above, the same mirrored: the fine value is the unfavourable end.
    above = banded([(2.0, 10.0 + 2.0**1.5), (1.0, 11.0)], ORDERS)
    assert (above.value, above.high) == (pytest.approx(10.0), 11.0)


def test_three_resolutions_in_one_ratio_show_their_order():
    # 10 - h^2 at 2.25, 1.5 and 1: observed order 2, the band ends a quarter beyond the limit.
    spacings = (2.25, 1.5, 1.0)
    found = banded([(h, 10.0 - h**2) for h in spacings], ORDERS)
    assert (found.order, found.sizes_mm) == ("observed", spacings)
    assert (found.low, found.value, found.high) == pytest.approx((9.0, 10.0, 10.25))
    narrow = banded([(h, 10.0 - h**2) for h in spacings[1:]], ORDERS)
    assert narrow.high - narrow.low > 2 * (found.high - found.low)
    # An order out of the range, or none, is not believed.
    for values in ((10.0 - h**6 for h in spacings), (9.0, 9.5, 9.2)):
        points = list(zip(spacings, values, strict=True))
        assert banded(points, ORDERS) == replace(banded(points[1:], ORDERS), sizes_mm=spacings)
    assert observed_order([(3.0, 1.0), (1.5, 2.0), (1.0, 2.5)]) is None  # ratios of 2 and 1.5


def test_residuals_of_tractions_give_the_band_where_values_fall():
    # A quarter and a fifth of residual: the finer value misses up to two fifths of that.
    found = banded([(1.5, 1.05), (1.0, 1.0)], ORDERS, shares(0.25, 0.2))
    assert found.order == "residual"
    assert (found.value, found.high) == pytest.approx((1.036, 1.08))
    # The coarse solid was too thin: 0.05 / (1.5^2 - 1).
    assert found.low == pytest.approx(1.0 - 0.05 / 1.25)
    # Of values below zero, the same mirrored.
    below = banded([(1.5, -1.05), (1.0, -1.0)], ORDERS, shares(0.25, 0.2))
    assert (below.low, below.value, below.high) == pytest.approx(
        (-found.high, -found.value, -found.low)
    )


def test_values_that_rise_tell_the_factor_of_their_residuals():
    # Both miss three tenths of their residual: 1 / (1 + 0.3 R).
    values = [(1.5, 1.0 / (1.0 + 0.3 * 0.4)), (1.0, 1.0 / (1.0 + 0.3 * 0.2))]
    found = banded(values, ORDERS, shares(0.4, 0.2))
    assert found.high == pytest.approx(1.0)
    assert found.low == pytest.approx(values[1][1] * 0.995)
    assert found.low < found.value < found.high
    # Hardly a rise where much is missing: the most that was measured.
    stuck = banded([(1.5, 0.999), (1.0, 1.0)], ORDERS, shares(0.41, 0.4))
    assert stuck.high == pytest.approx(1.0 + 0.4 * 0.4)
    # An order that three show is believed, unless the residual says that far more is missing.
    three = [(h, 10.0 - h**2) for h in (2.25, 1.5, 1.0)]
    assert banded(three, ORDERS, shares(0.3, 0.2, 0.1)).order == "observed"
    assert banded(three, ORDERS, shares(9.0, 8.0, 7.0)).order == "residual"
    # Values that fall evenly do not say that nothing is missing.
    falling = banded([(h, 10.0 + h**2) for h in (2.25, 1.5, 1.0)], ORDERS, shares(0.3, 0.2, 0.1))
    assert (falling.order, falling.high) == ("residual", pytest.approx(11.0 * 1.04))


def test_without_an_order_the_band_is_to_both_sides():
    # A tenth of change at a ratio of 1.25: 0.1 / (1.25^2 - 1) of 1.
    for coarse in (0.9, 1.1):
        found = banded([(1.25, coarse), (1.0, 1.0)], None)
        half = 0.1 / 0.5625
        assert (found.low, found.value, found.high) == pytest.approx((1 - half, 1.0, 1 + half))
        assert found.order == "unknown"
        assert found.half_width == pytest.approx(half)
    # Two meshes that agree by chance do not make a band of nothing: 4 % as measured.
    found = banded([(1.25, 1.0), (1.0, 1.0)], None)
    assert (found.low, found.high) == pytest.approx((0.96, 1.04))


#: Displacement of two gyroid cells (mini at density 0.45) and of one bcc cell across (density 0.25)
#: on stuffed tetrahedra, spacing in mm: measured with this code, docs/validation.md.
GYROID = ((1.5, 0.08486), (1.2, 0.07988), (0.9231, 0.07680), (0.75, 0.07799))
BCC = ((1.0909, 0.40821), (0.9231, 0.48371), (0.7059, 0.44979))


@pytest.mark.parametrize("found", [GYROID, BCC])
def test_bands_of_stuffed_tetrahedra_hold_the_finest_value(found):
    """Values that go up and down with the mesh: no order holds them, the band does."""
    finest = found[-1][1]
    for k in range(1, len(found) - 1):
        band = banded(found[: k + 1], None)
        assert band.low <= finest <= band.high
    assert not all(
        one.low <= finest <= one.high
        for one in (banded(found[: k + 1], ORDERS) for k in range(1, len(found) - 1))
    )


def test_spacings_that_are_the_same_give_no_band():
    with pytest.raises(CaseError, match="larger by 5 %"):
        banded([(1.02, 1.0), (1.0, 1.0)], ORDERS)


def a_row(low, value, high, limit, **more):
    return LimitRow(
        key=LimitKey(kind="any"), name="any", load_case="pull", value=value, limit=limit, unit="mm",
        judged_by="hand", band=Banded(value=value, low=low, high=high, sizes_mm=(2.0, 1.0)), **more,
    )  # fmt: skip


def test_a_limit_holds_when_the_unfavourable_end_holds():
    row = a_row(0.95, 1.0, 1.1, 1.05)
    assert (row.decisive, row.passed, row.undecided) == (1.1, False, True)
    assert row.utilisation == pytest.approx(1.1 / 1.05)
    assert a_row(0.95, 1.0, 1.1, 1.1).passed
    assert not a_row(0.95, 1.0, 1.1, 1.2).undecided
    # Of a kind that asks for at least so much, the low end decides.
    least = a_row(0.95, 1.0, 1.1, 0.97, unfavourable="low")
    assert (least.decisive, least.passed) == (0.95, False)
    assert a_row(0.95, 1.0, 1.1, 0.94, unfavourable="low").passed


def test_a_stored_row_keeps_its_band():
    row = a_row(0.95, 1.0, 1.1, 1.05)
    plain = {**asdict(row), "passed": row.passed}
    plain["band"]["sizes_mm"] = list(plain["band"]["sizes_mm"])  # as JSON gives it back
    assert row_from_json(plain) == row


def test_a_factor_with_a_band_of_its_own():
    row = a_row(0.9, 1.0, 1.1, 2.0).scaled(Banded(value=1.3, low=1.0, high=1.3), "submodels")
    assert (row.value, row.band.low, row.band.high) == pytest.approx((1.3, 0.9, 1.43))
    assert (row.judged_by, row.band.sizes_mm) == ("submodels", (2.0, 1.0))
    assert row.band.including(2.0).high == 2.0
    assert row.band.including(1.0) == row.band
