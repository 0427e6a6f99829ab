"""The power law that a case states for its cell."""

from __future__ import annotations

from gradedesign.errors import CaseError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.law_schema import PowerSpec, StatedLaw
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin, ScalingLaw


def stated_law(
    stated: StatedLaw, cell: Cell, density: tuple[float, float], poissons_ratio: float
) -> ScalingLaw:
    """Power law of a cell as stated, in the window of the cell.

    Parameters
    ----------
    density : (float, float)
        Relative densities that the case allows; the law is checked where the cell has them.
    poissons_ratio : float
        Of the base material, which the lattice keeps.

    Raises
    ------
    CaseError
        If it is stiffer or stronger than the base material in proportion to density.

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
