"""The row of an iteration in the result: predicted and explicit values of its design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gradedesign.mechanics.limits.key import LimitKey


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitIteration:
    """One limit in one iteration."""

    key: LimitKey
    name: str
    unit: str
    predicted: float  #: By the corrected homogenised part, before the analysis.
    explicit: float | None  #: None where no explicit analysis measures it.
    discrepancy: float | None  #: explicit / predicted - 1.
    factor: float  #: Correction of the prediction that this iteration's sizing used.

    @property
    def label(self) -> str:
        """Name and load case, where it has one."""
        return f"{self.name} ({self.key.load_case})" if self.key.load_case else self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Iteration:
    """One iteration: predicted and explicit values, and the corrections they lead to."""

    number: int  #: From 1.
    lattice_mass_g: float  #: By the explicit mesh.
    mass_g: float  #: By the explicit mesh.
    mean_density: float  #: Of the lattice phase, as sized.
    limits: tuple[LimitIteration, ...]
    utilisation: float  #: Largest value over limit.
    passed: bool
    dofs: int
    mesh_size_mm: float
    #: Grid spacing that the thinnest wall needed, less where that grid lost volume or components,
    #: and at most that of the iteration before where the memory holds that.
    spacing_mm: float
    seconds: float  #: s.
    #: Correction of the lattice's stiffness that this iteration's sizing used.
    stiffness_factor: float
    sizing_iterations: int
    sizing_converged: bool
    #: By stage, s. ``sizing``, ``explicit mesh``, ``explicit solve``; the rest of
    #: ``seconds`` is learning.
    timing_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def measured(self) -> tuple[LimitIteration, ...]:
        """Limits that the explicit analysis measures."""
        return tuple(limit for limit in self.limits if limit.explicit is not None)


def iteration_from_json(data: Mapping[str, Any]) -> Iteration:
    """The iteration that ``dataclasses.asdict`` made plain data of."""
    limits = tuple(
        LimitIteration(**{**entry, "key": LimitKey(**entry["key"])}) for entry in data["limits"]
    )
    return Iteration(**{**data, "limits": limits})
