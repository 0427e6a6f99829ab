"""Limits with what acceptance taught: by key."""

import pytest

from gradedesign.limits.key import LimitKey
from gradedesign.limits.row import LimitRow
from gradedesign.limits.verdict import all_hold, learned_factors, scaled_rows, with_factors

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


def test_rows_without_a_factor_keep_value_and_judge():
    rows = scaled_rows([moves("pull", 0.9), stress("pull", 80.0)], {STRESS: 1.1}, "w")
    assert rows[0] == moves("pull", 0.9)
    assert (rows[1].value, rows[1].judged_by) == (pytest.approx(88.0), "w")


def test_what_was_zero_before_teaches_nothing():
    assert learned_factors([moves("pull", 0.0)], [moves("pull", 0.1)]) == {}
