"""The law that a case will use, found without computing any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gradedesign.common.values.locate import Where
from gradedesign.design.resolve.choose_law import choose_law, usable_laws
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.law_schema import PowerSpec, StatedLaw
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.homogenise.cached_table import (
    ON_DEMAND_RESOLUTION,
    has_table,
    on_demand_resolution,
)
from gradedesign.mechanics.homogenise.table import table_densities
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.power_fit import GIBSON_ASHBY
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawKind, LawOrigin, ScalingLaw, has_strength

#: Minutes of one processor that a table takes at ON_DEMAND_RESOLUTION, least and most.
_TABLE_MINUTES = (1.0, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedLaw:
    """The law that a run will use."""

    name: str
    window: tuple[float, float]  #: Densities that it covers.
    why: str = ""  #: Why no registered law describes the cell; empty where one does.
    voxels: int = 0  #: Along the cell that it is computed on; 0 for a law that is known.
    tabulated: bool = True  #: Known, or in the user's cache.
    #: The law that needs no computing: registered, fitted to a registered one, or stated.
    known: ScalingLaw | None = None
    fitted: bool = False  #: Whether the run takes the power law fitted to the one that is computed.

    @property
    def kind(self) -> LawKind:
        """Kind of the law that the run takes."""
        if self.known is not None:
            return self.known.kind
        return "fitted" if self.fitted else "computed"

    @property
    def minutes(self) -> tuple[float, float]:
        """Predicted time of computing it, least and most; zero where it is known."""
        if self.tabulated:
            return 0.0, 0.0
        work = (self.voxels / ON_DEMAND_RESOLUTION) ** 3
        return _TABLE_MINUTES[0] * work, _TABLE_MINUTES[1] * work


def planned_law(
    lattice: LatticeSpec,
    limits: LimitsSpec,
    registry: Registry,
    cell: Cell,
    where: Where,
    *,
    poissons_ratio: float,
) -> PlannedLaw:
    """Choose between the registered laws and one that is computed for the cell.

    ``auto`` takes a registered law only for the family's default parameters in cells of equal
    edges, which are what laws describe; so does ``gibson-ashby``, of computed ones. A law that the
    case names or states is taken as it is. Raises `CaseError` as `choose_law` and `stated_law`; if
    the case limits stress and the law has no strength. Raises `DensityError` if the walls are too
    thin for any grid that a law is computed on; as `choose_law`.
    """
    law, edges = lattice.law, lattice.edges
    if isinstance(law, StatedLaw):
        known: ScalingLaw = stated_law(law, cell, lattice.densities, poissons_ratio)
        return _known(lattice, limits, known, where)
    changed = changed_parameters(cell.family, cell.parameters)
    unequal = min(edges) < max(edges)
    kinds = {k.kind for k in usable_laws(registry, cell.name)}
    served = "computed" in kinds if law == GIBSON_ASHBY else bool(kinds)
    if law not in ("auto", GIBSON_ASHBY) or (served and not changed and not unequal):
        known = choose_law(registry, cell.name, law, lattice.densities)
        return _known(lattice, limits, known, where)
    why = f"with {values_in_words(changed, cell.parameters)}" if changed else "of this cell"
    if unequal:
        why += f" with edges in proportion {proportion(edges)}"
    voxels = on_demand_resolution(cell, edges)
    densities = table_densities(cell, voxels, edges)
    computed = f"{cell.name}-computed{'-stretched' if unequal else ''}"
    return PlannedLaw(
        name=GIBSON_ASHBY if law == GIBSON_ASHBY else computed,
        window=(densities[0], densities[-1]),
        why=f"no law {why} is installed",
        voxels=voxels,
        tabulated=has_table(cell, poissons_ratio, voxels, edges),
        fitted=law == GIBSON_ASHBY,
    )


def _known(lattice: LatticeSpec, limits: LimitsSpec, law: ScalingLaw, where: Where) -> PlannedLaw:
    """A registered law; refused if it lacks a property that the limits need."""
    require_strength(lattice, limits, law, where)
    return PlannedLaw(name=law.name, window=law.window, known=law)


def require_strength(
    lattice: LatticeSpec, limits: LimitsSpec, law: ScalingLaw, where: Where
) -> None:
    """Refuse a law of stiffness alone where stress is limited, or mapped to density.

    Raises `CaseError`.
    """
    if has_strength(law):
        return
    limited = limits.limits_stress
    if not (limited or lattice.by_stress):
        return
    keys = ("stress", "safety_factor", "fatigue")
    key = next((key for key in keys if getattr(limits, key, None)), "")
    use, otherwise = (
        (f"{where(f'limits.{key}')} limits the stress in the lattice", "leave the limit out")
        if limited
        else (
            f"{where('lattice.method')} maps stress to density by it",
            'take method = "lightest"',
        )
    )
    cure = (
        "add strength = {c = ..., n = ...} to it"
        if law.kind == "stated"
        else "name a law with strength"
    )
    raise CaseError(f"law '{law.name}' has no strength, and {use}; {cure}, or {otherwise}")


def changed_parameters(family: CellFamily, parameters: Mapping[str, float]) -> list[str]:
    """Names of the parameters that differ from the family's defaults."""
    return [k for k, value in parameters.items() if value != family.parameters[k]]


def proportion(edges: Sequence[float]) -> str:
    """Edges over the shortest, in words."""
    return " : ".join(f"{edge / min(edges):.4g}" for edge in edges)


def values_in_words(names: list[str], parameters: Mapping[str, float]) -> str:
    """Named parameters with their values."""
    return ", ".join(f"{name} = {parameters[name]:g}" for name in names)


def stated_law(
    stated: StatedLaw, cell: Cell, density: tuple[float, float], poissons_ratio: float
) -> ScalingLaw:
    """Power law of a cell as stated, in the window of the cell.

    Raises CaseError if it is stiffer or stronger than the base material in proportion to density.

    ``density``: relative densities that the case allows; the law is checked where the cell has
    them. ``poissons_ratio``: of the base material, which the lattice keeps.

    References
    ----------
    L. J. Gibson, M. F. Ashby, Cellular solids, 2nd edition, Cambridge 1997, eqs. 5.6 and 5.27.
    """
    low, high = max(cell.window[0], density[0]), min(cell.window[1], density[1])
    _require_below_voigt("stiffness", stated.stiffness, low, high)
    if stated.strength is not None:
        _require_below_voigt("strength", stated.strength, low, high)
    return power_law(
        stated.words,
        (cell.name,),
        youngs=stated.stiffness.pair,
        strength=None if stated.strength is None else stated.strength.pair,
        window=cell.window,
        origin=LawOrigin(
            kind="stated",
            source="stated in the case",
            test="not stated",
            poissons_ratio=poissons_ratio,
        ),
    )


def _require_below_voigt(quantity: str, power: PowerSpec, low: float, high: float) -> None:
    """Refuse ``c rho^n > rho`` anywhere between two densities.

    By Voigt's bound for stiffness, and by that of Taylor for strength (uniform strain in both), no
    cell has a larger share of the solid's value than its density. The ratio ``c rho^(n-1)`` is
    monotone, so that its ends tell.
    """
    c, n = power.pair
    most = min(rho ** (1.0 - n) for rho in (low, high))
    # A law at its bound, such as c = 1 and n = 1, is allowed however the powers round.
    if c <= most * (1.0 + 1e-9):
        return
    worst = max((low, high), key=lambda rho: rho ** (n - 1.0))
    raise CaseError(
        f"a {quantity} of {c:g} rho^{n:g} is {c * worst**n:.3g} of the solid's at density "
        f"{worst:.3g}, and no cell has more than its density; expected c of at most {most:.4g} "
        f"with n = {n:g} for densities {low:.3g} to {high:.3g}, or other densities"
    )
