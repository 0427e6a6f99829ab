"""A limit beside the value that judged it: one line of the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from gradedesign.limits.key import LimitKey


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """One limit beside the value that judged it.

    Attributes
    ----------
    key : LimitKey
        Under which factors and discrepancies of this value are known.
    name : str
    load_case : str
        Load case that governs.
    value : float
    limit : float
    unit : str
    judged_by : str
        Analysis behind the value.
    resolution_error : float or None
        Relative change of the explicit value from the first mesh size to the second.
    measure : str
        How the value is taken from the analysis, such as ``largest nodal value on the region``.
    stated : str
        How the case states the limit where that is no number, such as ``2 x solid``.
    phase : str
        Phase of the solid whose stress is judged; empty for other values.
    homogenised : bool
        The value is the homogenised prediction, which no explicit analysis can replace.
    """

    key: LimitKey
    name: str
    load_case: str
    value: float
    limit: float
    unit: str
    judged_by: str
    resolution_error: float | None = None
    measure: str = ""
    stated: str = ""
    phase: str = ""
    homogenised: bool = False

    @property
    def utilisation(self) -> float:
        """Value over limit."""
        return self.value / self.limit

    @property
    def passed(self) -> bool:
        """Whether the limit holds."""
        return self.value <= self.limit


def row_from_json(data: Mapping[str, Any]) -> LimitRow:
    """The row that ``dataclasses.asdict`` made plain data of; further entries are ignored.

    Raises
    ------
    KeyError, TypeError
        If the data is of another layout.
    """
    known = {field.name for field in fields(LimitRow)}
    plain = {name: value for name, value in data.items() if name in known}
    return LimitRow(**{**plain, "key": LimitKey(**data["key"])})
