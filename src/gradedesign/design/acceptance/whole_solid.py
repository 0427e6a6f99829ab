"""Limits judged on a whole solid from two resolutions, finer ones until their bands decide."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from gradedesign.common.system.progress import stepping
from gradedesign.errors import LatticeError, MeshError, ResourceError
from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.limits.banded import LEAST_RATIO, Banded, Residual, banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import limit_rows

#: A band whose half is below this share of its value is narrow: where the limit lies in it, another
#: design is looked for instead of a finer analysis. Chosen, not measured.
NARROW = 0.02
#: Most resolutions of one design. Chosen, not measured.
MOST = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WholeStage:
    """Analyses of a whole solid at any resolution."""

    #: ``analyse(spacing) -> ExplicitResult``, mm; a `LatticeError` or `MeshError` where that
    #: spacing does not hold the solid, a `ResourceError` where the memory does not hold it.
    analyse: Callable[[float], ExplicitResult]
    spacing: float  #: mm. Of the first, cheap analysis.
    ratio: float  #: Of one spacing to the next finer one.
    #: With which the error of values that converge may fall, see `limits.banded.banded`.
    orders: Sequence[float] | None
    judged_by: str  #: Analysis and solid, in words.
    #: ``need(spacing) -> (fits, words)``: whether the budgets of the case hold that spacing, by
    #: prediction, and what it takes.
    need: Callable[[float], tuple[bool, str]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WholeJudgement:
    """Limits on a whole solid."""

    result: ExplicitResult  #: Of the finest analysis.
    #: With their bands; a row without one could be taken at one resolution only.
    rows: tuple[LimitRow, ...]
    refused: tuple[str, ...] = ()  #: Resolutions that could not be analysed, and why.
    #: Limits and load cases that lie in a wide band, with the cost of a finer analysis.
    undecided: Mapping[tuple[LimitKey, str], str] = field(default_factory=dict)


def judge_whole(limits: Sequence[Limit], stage: WholeStage) -> WholeJudgement:
    """Analyse a solid at two resolutions, and at finer ones while a wide band does not decide.

    A wide band that breaks its limit by less than its own width is refined too: the next design
    learns from its unfavourable end, which would ask for more than what is missing.

    The resolutions follow from the stated budgets, never from the time that is left.

    Raises LatticeError if no resolution holds the solid. Raises ResourceError if the memory does
    not hold the first one.
    """
    analyses = _Analyses(stage=stage, limits=limits)
    analyses.attempt(stage.spacing, first=True)
    goes_on = analyses.attempt(stage.spacing / stage.ratio)
    if not goes_on and analyses.values:
        analyses.attempt(stage.spacing * stage.ratio)
    elif len(analyses.values) == 1:  # the first one did not hold the solid
        goes_on = analyses.attempt(stage.spacing / stage.ratio**2)
    if not analyses.values:
        raise LatticeError(f"the whole solid was not analysed: {'; '.join(analyses.refused)}")
    while goes_on and any(map(_unclear, analyses.rows())) and len(analyses.values) < MOST:
        goes_on = analyses.attempt(analyses.values[-1][0] / stage.ratio)
    rows, finer = analyses.rows(), analyses.values[-1][0] / stage.ratio
    return WholeJudgement(
        result=analyses.finest(),
        rows=rows,
        refused=tuple(analyses.refused),
        undecided={
            (
                row.key,
                row.load_case,
            ): f"{row.name} ({row.load_case}): the band of {band.low:.4g} to {band.high:.4g} "
            f"{row.unit} does not decide the limit of {row.limit:.4g} {row.unit}; elements of "
            f"{finer:.3g} mm would narrow it and take {stage.need(finer)[1]}"
            for row, band in _undecided(rows)
        },
    )


#: Spacing, rows, and the residuals of those whose value has one.
_Values: TypeAlias = tuple[float, dict[LimitKey, LimitRow], Mapping[LimitKey, Residual]]


@dataclass(slots=True, kw_only=True)
class _Analyses:
    """Rows of one solid by spacing, coarse first, and the result of the finest analysis.

    That result is dropped while a finer one is made, and made again where that fails; ``asked`` is
    the spacing, mm, that gave it.
    """

    stage: WholeStage
    limits: Sequence[Limit]
    values: list[_Values] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    result: ExplicitResult | None = None
    asked: float = 0.0

    def attempt(self, spacing: float, *, first: bool = False) -> bool:
        """Analyse at a spacing that the budgets hold; True where it gave a new resolution."""
        fits, need = self.stage.need(spacing)
        if not fits and not first:
            self.refused.append(f"elements of {spacing:.3g} mm are out of budget: {need}")
            return False
        if self.values and spacing < self.values[-1][0]:
            self.result = None  # makes room: its values are known, and the finer one replaces it
        try:
            with stepping(f"elements of {spacing:.3g} mm"):
                result = self.stage.analyse(spacing)
        except ResourceError as error:
            if first:
                raise
            self.refused.append(f"elements of {spacing:.3g} mm were refused: {error}")
            return False
        except (LatticeError, MeshError) as error:
            self.refused.append(f"elements of {spacing:.3g} mm were refused: {error}")
            return False
        size = result.mesh_size
        if any(
            max(size, analysed_size) < LEAST_RATIO * min(size, analysed_size)
            for analysed_size, *_ in self.values
        ):
            self.refused.append(f"elements of {spacing:.3g} mm divide the part as others do")
            return False
        if not self.values or size < self.values[-1][0]:
            self.result, self.asked = result, spacing
        rows = limit_rows(self.limits, result, self.stage.judged_by)
        row_of = {row.key: row for row in rows}
        self.values.append((size, row_of, _residuals(rows, result)))
        self.values.sort(key=lambda entry: -entry[0])
        return True

    def finest(self) -> ExplicitResult:
        """Result of the finest analysis; made again where one that failed took its place."""
        if self.result is None:
            with stepping(f"elements of {self.asked:.3g} mm again"):
                self.result = self.stage.analyse(self.asked)
        return self.result

    def rows(self) -> tuple[LimitRow, ...]:
        """Rows of the finest analysis with their bands."""
        return tuple(self._banded(row) for row in self.values[-1][1].values())

    def _banded(self, row: LimitRow) -> LimitRow:
        analyses = [each for each in self.values if row.key in each[1]]
        if len(analyses) < 2:
            return row
        values = [(size, rows[row.key].value) for size, rows, _ in analyses]
        residuals = [lost[row.key] for *_, lost in analyses if row.key in lost]
        return row.banded(
            banded(
                values,
                self.stage.orders if row.converges else None,
                residuals if len(residuals) == len(values) else None,
            )
        )


def _residuals(rows: Sequence[LimitRow], result: ExplicitResult) -> dict[LimitKey, Residual]:
    """Residual of each row whose value converges: its own, or else that of the loads' work."""
    found: dict[LimitKey, Residual] = {}
    for row in rows:
        own = result.goal_residuals.get(row.key)
        if own is not None and row.value:
            size = abs(row.value)
            found[row.key] = Residual(rise=own.rise / size, fall=own.fall / size)
        elif row.load_case in result.traction_residual:
            found[row.key] = Residual(rise=result.traction_residual[row.load_case])
    return found


def _unclear(row: LimitRow) -> bool:
    """A wide band that does not decide, or that breaks its limit by less than its own width."""
    if row.band is None or row.band.half_width <= NARROW:
        return False
    low, high = row.band.low, row.band.high
    beyond = low - row.limit if row.unfavourable == "high" else row.limit - high
    return row.undecided or 0.0 < beyond < high - low


def _undecided(rows: Sequence[LimitRow]) -> list[tuple[LimitRow, Banded]]:
    """Rows whose limit lies in a wide band, so that nothing is decided."""
    return [
        (row, row.band)
        for row in rows
        if row.band is not None and row.undecided and row.band.half_width > NARROW
    ]
