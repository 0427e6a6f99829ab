"""The protocol of limits, used by sizing, the loop, acceptance, report and check.

A limit enters sizing by its gradient: it gives its value with the derivative by the displacements,
and sizing solves the adjoint problem.

Above 300 lines: the protocol of limits with the records that it is made from.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.values.locate import Where
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.limits.analysis import Analysis, SubmodelStress
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limits_schema import LimitEntry, LimitsSpec
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limit(ABC):
    """One limit of a case on the part as it is meshed.

    Attributes
    ----------
    name : str
        Of its row, such as ``"displacement of tip magnitude"``.
    allowed : float
        In `unit`. Not a number where it is `times_solid` and the solid part is not analysed yet.
    factor : float
        Correction of the predicted value from explicit analyses; 1 at first.
    times_solid : float or None
        Multiple of the solid part's value, where the limit is stated so.
    case_key : str
        Where the case states it, such as ``limits.displacement[0].magnitude``.
    """

    key: LimitKey
    name: str
    allowed: float
    factor: float = 1.0
    times_solid: float | None = None
    case_key: str = "limits"

    #: Unit of value and limit.
    unit: ClassVar[str]
    #: The homogenised state must hold stresses.
    needs_stress: ClassVar[bool] = False
    #: An explicit analysis measures it; else the homogenised prediction is its value throughout.
    explicit: ClassVar[bool] = True
    #: What it judges need not be there: then it has no row.
    may_lack: ClassVar[bool] = False
    #: End of a band that decides, ``"high"`` or ``"low"``.
    unfavourable: ClassVar[str] = "high"
    #: The value converges with the order that an analysis states; percentiles and maxima do not.
    converges: ClassVar[bool] = False
    #: No lattice has a better value than the fully solid part.
    solid_is_best: ClassVar[bool] = True
    #: Utilisation up to which a broken limit may hold again by changes elsewhere in the design.
    scatter: ClassVar[float] = 1.0

    @property
    def follows_stiffness(self) -> bool:
        """Whether the value says how stiff the design is: a displacement, a load factor."""
        return not self.needs_stress

    def compliance(self, value: float) -> float:
        """The value in the manner of a displacement, one over the stiffness that it follows."""
        return value

    def utilisation(self, value: float) -> float:
        """Value over limit, or limit over it where the low end is unfavourable.

        Of a frequency not the square of that ratio, as its stiffness would suggest: sizing takes
        logarithms, in which a power is a mere factor, and people read shares of the limit.
        """
        if self.unfavourable == "low":
            return self.allowed / value if value > 0.0 else math.inf
        return value / self.allowed

    def utilisation_slope(self, value: float) -> float:
        """Derivative of `utilisation` by the value."""
        if self.unfavourable == "low":
            return -self.allowed / value**2
        return 1.0 / self.allowed

    @property
    @abstractmethod
    def measure(self) -> str:
        """Way in which the value is taken from an analysis, in words."""

    @property
    def stated(self) -> str:
        """The limit as the case states it where that is no number, such as ``2 x solid``."""
        return "" if self.times_solid is None else f"{self.times_solid:g} x solid"

    @abstractmethod
    def predict(self, state: HomogenisedState) -> Predicted:
        """Value on the homogenised part, times `factor`."""

    @abstractmethod
    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """Values with their derivatives, the governing one first."""

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:  # noqa: ARG002
        """Values in an analysis of the solid part or of the explicit lattice; none unless measured.

        The row of the limit's own key updates the correction.
        """
        return ()

    def goal(self) -> DisplacementGoal | None:
        """The value as one of a region's displacement, whose own error acceptance estimates.

        None: the value is no such one, or is taken over several load cases.
        """
        return None

    def mode(self) -> ModeGoal | None:
        """The value as that of a mode that analyses are to find; None: it is none."""
        return None

    def submodel_factor(self, submodels: Sequence[SubmodelStress]) -> Banded | None:  # noqa: ARG002
        """Factor of submodels of the printed surface over their driving analysis, with its band.

        None: submodels do not judge this limit.
        """
        return None

    def hot_spots(self, analysis: Analysis) -> tuple[str, ...]:  # noqa: ARG002
        """Warnings of places beyond the limit that its value passes over."""
        return ()

    def rest(self, analysis: Analysis) -> float:  # noqa: ARG002
        """Value of the solid part below which a multiple of it means nothing, in `unit`."""
        return 0.0

    def notes(self, volumes: FloatArray, rho: FloatArray) -> tuple[str, ...]:  # noqa: ARG002
        """Warnings about a design: volumes of lattice ``(M,)``, mm^3, and densities ``(M,)``."""
        return ()

    def basis(self) -> Mapping[str, float]:
        """Numbers beside the law of the lattice in the report."""
        return {}

    def row(
        self, value: float, judged_by: str, *, load_case: str = "", homogenised: bool = False
    ) -> LimitRow:
        """The row of a value."""
        return LimitRow(
            key=self.key,
            name=self.name,
            load_case=load_case or self.key.load_case,
            value=float(value),
            limit=self.allowed,
            unit=self.unit,
            judged_by=judged_by,
            measure=self.measure,
            stated=self.stated,
            homogenised=homogenised,
            unfavourable=self.unfavourable,
            converges=self.converges,
            solid_is_best=self.solid_is_best,
        )


def limits_stress(limits: Sequence[Limit]) -> bool:
    """Whether an explicit analysis judges a stress."""
    return any(limit.needs_stress and limit.explicit for limit in limits)


def predicted_row(limit: Limit, predicted: Predicted) -> LimitRow:
    """The row of a homogenised prediction."""
    judged_by = "homogenised prediction"
    if predicted.place is not None:
        judged_by += f", most used at ({', '.join(f'{c:.1f}' for c in predicted.place)}) mm"
    if predicted.governs:
        judged_by += f"; {predicted.governs} govern"
    if predicted.extrapolated:
        judged_by += f"; no data: {predicted.extrapolated}"
    row = limit.row(predicted.value, judged_by, load_case=predicted.load_case, homogenised=True)
    return replace(row, extrapolated=bool(predicted.extrapolated))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedModel:
    """The part as it is meshed, loaded and held: what limits are made from.

    Attributes
    ----------
    where : Where
        Names file and line of a key of the case, for messages.
    load_cases : tuple of LoadCaseSpec
        As the case states them.
    evaluated : (M,) bool array
        Tetrahedra outside the exclusion radius around clamped regions.
    lattice_volumes : (M,) array, mm^3
    exclusion_radius : float, mm
    nodes : mapping of region to (k,) int array
        Nodes of the regions that `LimitKind.stated` names, edge middles included.
    shares : mapping of region to (k,) array
        Share of the region's area that each of its nodes stands for.
    supports : mapping of load case to Supports
    solids : mapping of region to (k,) int array
        Number of the kept solid that each of its nodes belongs to, -1 where it belongs to none.
    filter_radius : float, mm
        Over which sizing smooths the density.
    members : bool
        Whether sizing may make solid members.
    cells : bool
        Whether cells are built.
    """

    where: Where
    load_cases: tuple[LoadCaseSpec, ...]
    material: Material
    law: LawField
    evaluated: BoolArray
    lattice_volumes: FloatArray
    exclusion_radius: float
    nodes: Mapping[str, IntArray]
    shares: Mapping[str, FloatArray]
    supports: Mapping[str, Supports]
    solids: Mapping[str, IntArray] = field(default_factory=dict)
    filter_radius: float = 0.0
    members: bool = False
    cells: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedLimit:
    """A limit as the case states it, known without a mesh.

    Attributes
    ----------
    load_case : str
        ``"every"`` for one on the largest value over all load cases.
    allowed : str
        Such as ``"2 mm"`` or ``"2 x solid"``.
    region : str
        Region of the part that it applies to, or empty.
    explicit : bool
        An explicit analysis measures it.
    modes : int
        Lowest modes that analyses find for it.
    """

    name: str
    load_case: str
    allowed: str
    region: str = ""
    explicit: bool = True
    modes: int = 0


def stated_goals(limits: Iterable[StatedLimit]) -> int:
    """Number of limits that have a `Limit.goal`, as far as the case tells."""
    return sum(bool(limit.region) for limit in limits)


def stated_modes(limits: Iterable[StatedLimit]) -> int:
    """Most modes that limits ask of one analysis."""
    return max((limit.modes for limit in limits), default=0)


def mode_goals(limits: Iterable[Limit]) -> dict[Hashable, ModeGoal]:
    """Natural frequencies and load factors that limits ask of an analysis, by their keys."""
    return {limit.key: goal for limit in limits if (goal := limit.mode()) is not None}


def _no_refusal(
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    regions: Mapping[str, Region],
    where: Where,
) -> None:
    """Nothing about the surface of a part makes a limit impossible."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitKind:
    """A kind of limit, as a plugin registers it.

    Attributes
    ----------
    name : str
        `LimitKey.kind` of its limits, and the key of its list in ``[limits]``.
    make : callable
        ``make(LimitsSpec, PlacedModel) -> (limits, warnings)``: the limits that ``[limits]``
        states. A `CaseError` refuses one that no design can change.
    stated : callable
        ``stated(LimitsSpec, load cases, Material) -> sequence of StatedLimit``: the same without a
        mesh.
    entry : type of LimitEntry or None
        Layout of one table of ``[limits] name = [{...}]``; None: its keys are the core's.
    require : callable
        ``require(LimitsSpec, load cases, regions, Where)``: raises a `CaseError` for what the
        part's surface shows to be impossible.
    """

    name: str
    make: Callable[[LimitsSpec, PlacedModel], tuple[Sequence[Limit], Sequence[str]]]
    stated: Callable[[LimitsSpec, Sequence[LoadCaseSpec], Material], Sequence[StatedLimit]]
    entry: type[LimitEntry] | None = None
    require: Callable[[LimitsSpec, Sequence[LoadCaseSpec], Mapping[str, Region], Where], None] = (
        _no_refusal
    )
