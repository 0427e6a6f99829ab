"""A whole solid judged from two resolutions or more, by a stand-in analysis."""

import weakref
from types import SimpleNamespace

import pytest

from gradedesign.design.acceptance.whole_solid import WholeStage, judge_whole
from gradedesign.design.loop import accepted_rows
from gradedesign.errors import LatticeError, ResourceError
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow

ORDERS = (0.75, 1.5, 3.0)


class Tip:
    """A limit on the displacement of a tip that an analysis gives as ``result.tip``."""

    explicit = True

    def __init__(self, allowed):
        self.allowed = allowed

    def rows(self, result, judged_by):
        key = LimitKey(kind="displacement", region="tip", load_case="pull")
        return (
            LimitRow(
                key=key, name="tip", load_case="pull", value=result.tip, limit=self.allowed,
                unit="mm", judged_by=judged_by, converges=True,
            ),
        )  # fmt: skip


class Found(SimpleNamespace):
    """A result of which it can be asked whether it is still kept."""


class Stand:
    """An analysis whose tip moves by 1 - slope h^1.5 at elements of h mm; 1 mm are the first."""

    def __init__(self, slope=0.02, fails=(), finest=0.0):
        self.slope, self.fails, self.finest = slope, dict(fails), finest
        self.tried = []

    def analyse(self, spacing):
        self.tried.append(round(spacing, 4))
        for size, error in self.fails.items():
            if abs(spacing - size) < 1e-3:
                raise error
        return Found(
            mesh_size=spacing,
            tip=1.0 - self.slope * spacing**1.5,
            traction_residual={},
            goal_residuals={},
        )

    def judge(self, allowed, ratio=1.5):
        stage = WholeStage(
            analyse=self.analyse, spacing=1.0, ratio=ratio, orders=ORDERS, judged_by="stand-in",
            need=lambda h: (h >= self.finest, f"{1 / h**3:.3g} M unknowns"),
        )  # fmt: skip
        return judge_whole([Tip(allowed)], stage)


def test_two_resolutions_suffice_where_the_limit_lies_outside_the_band():
    stand = Stand()
    found = stand.judge(1.5)
    assert stand.tried == [1.0, 0.6667]
    (row,) = found.rows
    assert row.value == pytest.approx(1.0)
    assert row.band.sizes_mm == pytest.approx((1.0, 2 / 3))
    assert row.band.low < 1.0 < row.band.high
    assert row.judged_by == "stand-in"
    assert found.result.mesh_size == pytest.approx(2 / 3)
    assert (found.refused, found.undecided) == ((), {})


def test_a_wide_band_that_holds_the_limit_is_refined_until_it_decides():
    # From 1 and 2/3 mm the band is 0.891 to 1.145; with 4/9 mm the order is seen.
    stand = Stand(slope=0.2)
    (row,) = stand.judge(1.05).rows
    assert stand.tried == [1.0, 0.6667, 0.4444]
    assert (row.band.order, row.passed) == ("observed", True)
    assert row.value == pytest.approx(1.0)


def test_a_wide_band_just_beyond_its_limit_is_refined_for_what_it_teaches():
    # 0.891 to 1.145 breaks 0.85 by less than its width: the far end would ask for a third more.
    stand = Stand(slope=0.2)
    (row,) = stand.judge(0.85).rows
    assert stand.tried == [1.0, 0.6667, 0.4444]
    assert (row.passed, row.undecided) == (False, False)
    assert row.decisive == pytest.approx(1.0, abs=0.02)
    far = Stand(slope=0.2)
    far.judge(0.6)
    assert len(far.tried) == 2


def test_a_narrow_band_that_holds_the_limit_is_left_to_the_next_design():
    stand = Stand(slope=0.02)
    (row,) = stand.judge(1.001).rows
    assert (row.passed, row.undecided) == (False, True)
    assert len(stand.tried) == 2


def test_where_budgets_end_the_refinement_it_says_what_it_would_take():
    stand = Stand(slope=0.2, finest=0.6)
    found = stand.judge(1.05)
    assert stand.tried == [1.0, 0.6667]
    assert not found.rows[0].passed
    (words,) = found.undecided.values()
    assert "does not decide the limit of 1.05 mm" in words
    assert "elements of 0.444 mm would narrow it and take 11.4 M unknowns" in words
    assert any("0.444 mm are out of budget" in text for text in found.refused)


def test_where_the_finer_one_does_not_fit_a_coarser_one_is_taken():
    stand = Stand(finest=0.9)
    found = stand.judge(1.5)
    assert stand.tried == [1.0, 1.5]
    assert found.rows[0].band.sizes_mm == (1.5, 1.0)
    assert found.result.mesh_size == 1.0  # the finest one drives the submodels


def test_a_first_resolution_that_loses_walls_is_left_behind():
    stand = Stand(fails={1.0: LatticeError("lost")})
    found = stand.judge(1.5)
    assert stand.tried == [1.0, 0.6667, 0.4444]
    assert found.rows[0].band.sizes_mm == pytest.approx((2 / 3, 4 / 9))


def test_one_resolution_gives_no_band():
    lost = LatticeError("lost")
    found = Stand(fails={2 / 3: lost, 1.5: lost}).judge(1.5)
    assert found.rows[0].band is None
    assert len(found.refused) == 2
    # The finer one that failed had taken the place of its result.
    assert found.result.mesh_size == 1.0


def test_a_result_makes_room_for_a_finer_one():
    """Weights, displacements and stress of 4 million unknowns take half a gigabyte."""

    class Watched(Stand):
        made = ()

        def analyse(self, spacing):
            assert [result() for result in self.made] == [None] * len(self.made)
            result = super().analyse(spacing)
            self.made = (*self.made, weakref.ref(result))
            return result

    found = Watched(slope=0.2).judge(1.05)
    assert found.result.mesh_size == pytest.approx(4 / 9)


def test_no_resolution_at_all_is_an_error_by_name():
    lost = LatticeError("walls are lost")
    with pytest.raises(LatticeError, match="walls are lost"):
        Stand(fails={1.0: lost, 2 / 3: lost, 4 / 9: lost}).judge(1.5)
    with pytest.raises(ResourceError, match="8 GB"):
        Stand(fails={1.0: ResourceError("needs 8 GB")}).judge(1.5)


def test_elements_that_divide_the_part_alike_are_no_second_resolution():
    stand = Stand()
    same = stand.analyse
    stand.analyse = lambda h: SimpleNamespace(**(vars(same(h)) | {"mesh_size": 1.0}))
    found = stand.judge(1.5)
    assert found.rows[0].band is None
    assert "divide the part as others do" in found.refused[0]


PIECES = LatticeError("3 pieces")


@pytest.mark.parametrize("fails", [{}, {1.5: PIECES}, {1.5: PIECES, 1.2: PIECES}])
def test_a_design_without_acceptance_has_bands_from_coarser_elements(monkeypatch, fails):
    """Its own analysis, of 1 mm, is not made again, and none finer; no band where those fail."""
    stand = Stand(slope=0.2, fails=fails)
    monkeypatch.setattr(
        accepted_rows, "analyse_printed_solid", lambda _a, _s, at, _say: stand.analyse(at.spacing)
    )
    analysis = SimpleNamespace(name="finite-cells")
    predicted = SimpleNamespace(homogenised=True)
    best = SimpleNamespace(rows=(SimpleNamespace(homogenised=False), predicted))
    analysed = SimpleNamespace(result=stand.analyse(1.0), solid=None)
    row, last = accepted_rows.best_rows((Tip(0.9),), analysis, best, analysed, None)
    assert last == predicted
    assert stand.tried == [1.0, 1.5, 1.2][: 3 if fails else 2]
    if 1.2 in fails:
        assert (row.value, row.band) == (0.8, None)
        return
    # Exact: 1, of order 1.5, which is the middle of the assumed ones.
    assert row.value == pytest.approx(1.0)
    assert row.band.sizes_mm == (1.2 if fails else 1.5, 1.0)
    assert (row.band.low, row.word) == (pytest.approx(0.8), "UNSURE")
