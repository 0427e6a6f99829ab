"""Cell buckling: the macroscopic stress must stay below a share of that which buckles a cell.

Explicit analyses are linear and do not include it, so the homogenised prediction decides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.largest import largest_and_slope
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: What `LawField.buckling` tells apart.
WAVES = ("waves of one or two cells", "waves of many cells")
#: Exponent of the norm: a tetrahedron that is used 10 % less than the worst weighs a fifth of it.
#: Chosen, not measured.
_NORM = 16.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BucklingLimit(Limit):
    """Acting over critical stress, at most one over the required factor."""

    law: LawField

    unit: ClassVar[str] = "of the critical stress"
    needs_stress: ClassVar[bool] = True
    explicit: ClassVar[bool] = False

    @property
    def measure(self) -> str:
        """The most used element."""
        return "most used element of the part"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Largest share over all tetrahedra that hold lattice, and all load cases.

        Clamped edges are not excluded: unlike a yielding point, a buckling cell spreads. In denser
        cells than the law knows critical stresses grow with density, see `BucklingLaw`.
        """
        shares = np.stack([self._uses(state, name) for name in state.load_cases])
        most = np.unravel_index(int(np.argmax(shares)), shares.shape)
        case, waves, element = (int(k) for k in most)
        data = "" if waves else self._outside(state.effective_density, element)
        x, y, z = (float(c) for c in state.centroids[:, element])
        return Predicted(
            value=float(shares[most]),
            load_case=state.load_cases[case],
            place=(x, y, z),
            governs=WAVES[waves],
            extrapolated=data,
        )

    def _uses(self, state: HomogenisedState, load_case: str) -> FloatArray:
        """Shares of the resistance of every tetrahedron that holds lattice, ``(2, M)``."""
        use = self.law.buckling(state.buckling_profile(load_case), state.effective_density)
        return np.where(state.lattice_volumes > 0, use, 0.0)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """The largest share of every load case, see `largest_and_slope`."""
        found = []
        for name in state.load_cases:
            value, by_use = largest_and_slope(self._uses(state, name), _NORM)
            by_displacement, by_density = state.through_buckling(name, by_use)
            response = Response(
                name=f"{self.name} ({name})",
                load_case=name,
                value=value,
                by_displacement=by_displacement,
                by_design=state.by_density(by_density),
            )
            found.append(response)
        return tuple(sorted(found, key=lambda each: -each.value))

    def _outside(self, density: FloatArray, element: int) -> str:
        """Say how an element's density is outside the computed ones; empty if it is inside."""
        low, high = (
            float(np.broadcast_to(end, density.shape)[element]) for end in self.law.buckling_window
        )
        rho = float(density[element])
        if low * (1 - 1e-9) <= rho <= high * (1 + 1e-9):
            return ""
        how = (
            f"those of {high:g} are taken to grow as density does, slower than all computed ones"
            if rho > high
            else f"the power law of the two least densities goes on below {low:g}"
        )
        return (
            f"critical stresses were computed at densities {low:g} to {high:g}, the cells there "
            f"have {rho:.3g}; {how}"
        )

    def notes(self, volumes: FloatArray, rho: FloatArray) -> tuple[str, ...]:
        """Share of a lattice that is thinner than buckling is known for."""
        least, _ = self.law.buckling_window
        share = float(volumes[rho < least * (1 - 1e-9)].sum() / volumes.sum())
        if share == 0:
            return ()
        return (
            f"{share:.1%} of the lattice is thinner than relative density {np.min(least):g}, from "
            f"which on buckling of its law was computed; below, its power law is extrapolated",
        )

    def basis(self) -> Mapping[str, float]:
        """The required factor."""
        # Rounded: 1.46 as stated, not 1.4600000000000002.
        return {"buckling_factor": float(f"{1.0 / self.allowed:.12g}")}


def _required_factor(limits: LimitsSpec) -> float | None:
    """Required critical over acting stress: beside a stress limit, or where it is stated."""
    if limits.buckling == "off":
        return None
    if limits.buckling_factor is not None:
        return limits.buckling_factor
    if limits.safety_factor is not None:
        return limits.safety_factor
    return 1.0 if limits.limits_stress else None


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    required = _required_factor(limits)
    if required is None:
        return (), ()
    unknown = [law for law in placed.law.laws if law.buckling is None]
    limit = BucklingLimit(
        key=LimitKey(kind=KIND.name),
        name="buckling of cells",
        allowed=1.0 / required,
        law=placed.law,
    )
    return (limit,), tuple(unknown_warning(law) for law in unknown)


def unknown_warning(law: ScalingLaw) -> str:
    """Warning where the law knows no modes of one or two cells."""
    return (
        f"buckling of the cells is judged in {WAVES[1]} only: law '{law.name}' has no critical "
        f"stresses of {WAVES[0]} ('gradedesign tabulate --buckling' computes them); [limits] "
        f'buckling = "off" leaves it out'
    )


def _stated(
    limits: LimitsSpec, _load_cases: Sequence[LoadCaseSpec], _material: Material
) -> Sequence[StatedLimit]:
    required = _required_factor(limits)
    if required is None:
        return ()
    allowed = f"{1.0 / required:.4g} {BucklingLimit.unit}"
    return (
        StatedLimit(name="buckling of cells", load_case="every", allowed=allowed, explicit=False),
    )


#: Buckling of cells, ``buckling_factor = 2``; beside a stress limit unless ``buckling = "off"``.
KIND = LimitKind(name="buckling", make=_make, stated=_stated)
