"""Limits with what acceptance taught: by key."""

from dataclasses import replace

import pytest

from gradedesign.errors import SolverError
from gradedesign.mechanics.limits.banded import Banded, Residual, banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import (
    all_hold,
    expected_factors,
    learned_factors,
    with_factors,
)

STRESS = LimitKey(kind="stress", region="lattice")


def moves(case, value, limit=1.0):
    return LimitRow(
        key=LimitKey(kind="displacement", region="tip", component="magnitude", load_case=case),
        name="displacement of tip magnitude",
        load_case=case,
        value=value,
        limit=limit,
        unit="mm",
        judged_by="explicit analysis",
    )


def stress(case, value):
    return LimitRow(
        key=STRESS,
        name="stress in lattice",
        load_case=case,
        value=value,
        limit=100.0,
        unit="MPa",
        judged_by="explicit analysis",
    )


def test_one_region_in_two_load_cases_learns_both_misses():
    """Accepted 5 % above in the first case, 20 % above in the second, which is moved less."""
    explicit = [moves("pull", 0.9), moves("side", 0.85)]
    accepted = [moves("pull", 0.945), moves("side", 1.02)]
    factors = learned_factors(explicit, accepted)
    assert factors[explicit[0].key] == pytest.approx(1.05)
    assert factors[explicit[1].key] == pytest.approx(1.2)
    assert [r.value for r in with_factors(explicit, factors)] == pytest.approx([0.945, 1.02])
    assert not all_hold(with_factors(explicit, factors))


def test_stress_is_learned_over_all_load_cases():
    """Another load case may govern the accepted stress: 88 over 80 is what matters."""
    factors = learned_factors([stress("pull", 80.0)], [stress("side", 88.0)])
    assert with_factors([stress("pull", 50.0)], factors)[0].value == pytest.approx(55.0)


def test_the_unfavourable_end_is_learned():
    """Explicit 0.9, accepted 0.93 to 1.08: the next design must hold at 1.08, 1.2 times 0.9."""
    band = Banded(value=0.95, low=0.93, high=1.08)
    accepted = [replace(moves("pull", 0.95), band=band)]
    assert not all_hold(accepted)
    factors = learned_factors([moves("pull", 0.9)], accepted)
    assert with_factors([moves("pull", 0.9)], factors)[0].value == pytest.approx(1.08)


def test_the_residual_of_the_tractions_lets_expect_the_unfavourable_end():
    """0.18 of the residual, the share by which values usually fall short."""
    explicit = [replace(moves("pull", 0.9), converges=True), stress("pull", 50.0)]
    explicit += [replace(moves("heat", 0.2), converges=True)]
    factors = expected_factors(explicit, {"pull": 0.4})
    assert factors[explicit[0].key] == pytest.approx(1.072)
    assert explicit[2].key not in factors  # moved by heat, of which no residual is known
    # What two resolutions then find of a value that falls short by 0.18 of the residual: 0.4 and
    # half of it over elements half as long.
    true = 0.9 * (1 + 0.18 * 0.4)
    finer = true / (1 + 0.18 * 0.2)
    band = banded(
        [(2.0, 0.9), (1.0, finer)], (1.0, 2.0, 3.0), [Residual(rise=0.4), Residual(rise=0.2)]
    )
    assert 0.9 * factors[explicit[0].key] == pytest.approx(true)
    # The band reaches a little beyond it, by the residual that its finer elements leave.
    assert true < band.high < 1.02 * true


def test_the_least_band_of_a_percentile_is_expected_before_any_acceptance():
    """Two resolutions that agree still leave 4 %: 100 MPa are judged at 104."""
    rows = [stress("pull", 100.0), replace(stress("side", 1.0), homogenised=True)]
    rows += [replace(stress("lift", 100.0), unfavourable="low")]
    rows = [replace(r, key=replace(r.key, load_case=r.load_case)) for r in rows]
    factors = expected_factors(rows, {})
    judged = rows[0].banded(banded([(2.0, 100.0), (1.0, 100.0)], None, None))
    assert factors[rows[0].key] * 100.0 == pytest.approx(judged.decisive)
    assert rows[1].key not in factors
    least = rows[2].banded(banded([(2.0, 100.0), (1.0, 100.0)], None, None))
    assert factors[rows[2].key] * 100.0 == pytest.approx(least.decisive)


def test_what_was_zero_before_is_learned_or_an_error():
    """No factor leads from 0 to 0.1, and without one the loop would take the miss for a hit."""
    zero = moves("pull", 0.0)
    assert learned_factors([zero], [zero]) == {zero.key: 1.0}
    with pytest.raises(SolverError, match=r"is 0 mm in the explicit analysis but 0\.1 mm"):
        learned_factors([zero], [moves("pull", 0.1)])


def test_what_only_acceptance_knows_teaches_nothing():
    assert learned_factors([moves("pull", 0.5)], [moves("side", 0.5)]) == {}
