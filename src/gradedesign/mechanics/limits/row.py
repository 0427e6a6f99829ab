"""A limit with the value that is compared with it: one line of the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey

#: Share of its body that a limit must judge to hold, and of the submodels that were to correct it.
#: Of less than half the rest is the larger part, and the limit would say nothing of it. Chosen, not
#: measured.
LEAST_JUDGED = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """A limit with the value that is compared with it.

    Attributes
    ----------
    key : LimitKey
        Under which factors and discrepancies of this value are known.
    load_case : str
        Load case that governs.
    value : float
        Expected one; the end of its band that decides is `decisive`.
    judged_by : str
        Analysis behind the value.
    band : Banded or None
        Where the value is expected for small elements; None: it was taken at one resolution.
    unfavourable : {"high", "low"}
        End of the band that decides.
    converges : bool
        The value converges with the order that an analysis states, see `Limit.converges`.
    measure : str
        How the value is taken from the analysis, such as ``largest nodal value on the region``.
    stated : str
        How the case states the limit where that is no number, such as ``2 x solid``.
    phase : str
        Phase of the solid whose stress is judged; empty for other values.
    homogenised : bool
        The value is the homogenised prediction, which no explicit analysis can replace.
    judged : float
        Share of the limit's body that is judged, by volume: 1 but for stress, which is not judged
        around supports that make it singular. Of the lattice, or of the solid part.
    extrapolated : bool
        The value lies outside the data of its law; `judged_by` says why.
    largest : float or None
        Largest value of that analysis where the value is its percentile.
    solid_is_best : bool
        No lattice has a better value than the fully solid part.
    remeshed : float
        Share of the submodels that were to correct the value, or of the whole surface, of which an
        independent mesh could be made and solved; 1 for a value that no such mesh judges.
    nominal, as_built : float or None
        Expected values of the designed body and of the one that the process builds of it, of which
        the row's own is one: their bands are of different elements. None without a process.
    """

    key: LimitKey
    name: str
    load_case: str
    value: float
    limit: float
    unit: str
    judged_by: str
    band: Banded | None = None
    unfavourable: str = "high"
    converges: bool = False
    measure: str = ""
    stated: str = ""
    phase: str = ""
    homogenised: bool = False
    judged: float = 1.0
    extrapolated: bool = False
    largest: float | None = None
    remeshed: float = 1.0
    solid_is_best: bool = True
    nominal: float | None = None
    as_built: float | None = None

    @property
    def decisive(self) -> float:
        """The unfavourable end of the band; the value where there is none."""
        if self.band is None:
            return self.value
        return self.band.high if self.unfavourable == "high" else self.band.low

    @property
    def favourable(self) -> float:
        """The other end of the band; the value where there is none."""
        if self.band is None:
            return self.value
        return self.band.low if self.unfavourable == "high" else self.band.high

    @property
    def utilisation(self) -> float:
        """Decisive value over limit, or limit over it where the low end is unfavourable."""
        return self._used(self.decisive)

    @property
    def words(self) -> str:
        """Decisive value beside the limit, as every text shows it: ``43.9 of 50 MPa, 87.8%``."""
        stated = f" ({self.stated})" if self.stated else ""
        return (
            f"{self.decisive:.4g} of {self.limit:.4g} {self.unit}{stated}, {self.utilisation:.1%}"
        )

    @property
    def band_words(self) -> str:
        """Both ends of the band, ``40.1 to 43.9``; empty where there is none."""
        return "" if self.band is None else f"{self.band.low:.4g} to {self.band.high:.4g}"

    @property
    def bodies_words(self) -> str:
        """Both bodies beside each other, ``nominal 43.9, as built 41.2 MPa``; empty without any."""
        if self.nominal is None or self.as_built is None:
            return ""
        return f"nominal {self.nominal:.4g}, as built {self.as_built:.4g} {self.unit}".rstrip()

    @property
    def passed(self) -> bool:
        """Whether the limit holds at the unfavourable end of the band, and judges enough."""
        return self.utilisation <= 1.0 and self.judges_enough

    @property
    def judges_enough(self) -> bool:
        """Whether at least `LEAST_JUDGED` of the body, and of its submodels, was judged."""
        return min(self.judged, self.remeshed) >= LEAST_JUDGED

    @property
    def least_utilisation(self) -> float:
        """Utilisation at the favourable end of the band; at the value if there is no band."""
        return self._used(self.favourable)

    @property
    def broken(self) -> bool:
        """Whether the limit is broken even at the favourable end of the band."""
        return self.least_utilisation > 1.0

    @property
    def word(self) -> str:
        """For tables: ``holds``, ``BROKEN``, ``UNSURE`` or ``UNJUDGED``.

        Unsure where the favourable end of the band alone holds, unjudged where it judges too
        little; ``, extrapolated`` follows where the value lies outside the data of its law.
        """
        if not self.judges_enough:
            return "UNJUDGED"
        word = "holds" if self.passed else "UNSURE" if self.undecided else "BROKEN"
        return f"{word}, extrapolated" if self.extrapolated else word

    @property
    def undecided(self) -> bool:
        """Whether the limit lies inside the band, so that only one end meets it."""
        return self.band is not None and self.band.low <= self.limit <= self.band.high

    def _used(self, value: float) -> float:
        """Utilisation by a value."""
        if self.limit == 0.0 and self.unfavourable == "high":
            return 0.0 if value <= 0.0 else math.inf
        if self.unfavourable == "low":
            return self.limit / value if value > 0.0 else math.inf
        return value / self.limit

    def banded(self, band: Banded) -> LimitRow:
        """The row with the value of a band."""
        return replace(self, value=band.value, band=band)

    def scaled(self, factor: Banded, judged_by: str) -> LimitRow:
        """The row times a factor that has a band of its own."""
        if self.band is None:
            value = self.value * factor.value
            return replace(self, value=value, judged_by=judged_by, largest=None)
        band = self.band.scaled(factor.low, factor.value, factor.high)
        return replace(self, value=band.value, band=band, judged_by=judged_by, largest=None)


def row_from_json(data: Mapping[str, Any]) -> LimitRow:
    """The row that ``dataclasses.asdict`` made plain data of; further entries are ignored.

    Raises `KeyError` or `TypeError` if the data is of another layout.
    """
    field_names = {field.name for field in fields(LimitRow)}
    plain = {name: value for name, value in data.items() if name in field_names}
    if (band := plain.get("band")) is not None:
        plain["band"] = Banded(**{**band, "sizes_mm": tuple(band["sizes_mm"])})
    return LimitRow(**{**plain, "key": LimitKey(**data["key"])})
