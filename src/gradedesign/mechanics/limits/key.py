"""The key of a limit, its name in factors, discrepancies and stored iterations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class LimitKey:
    """Identity of a limit; two limits of one key speak about the same value.

    Attributes
    ----------
    kind : str
        Name of the kind of limit.
    region : str
        Region of the part, or phase of the printed solid; empty for the whole part.
    component : str
        ``"x"``, ``"y"``, ``"z"``, ``"magnitude"``, ``"mode 1"``, or empty.
    load_case : str
        Empty for a limit on the largest value over all load cases.
    """

    kind: str
    region: str = ""
    component: str = ""
    load_case: str = ""


#: Values by key, in the order of the limits; plain tuples, so that they can be stored.
KeyedValues: TypeAlias = tuple[tuple[LimitKey, float], ...]


def keyed_from_json(pairs: Sequence[Sequence[object]]) -> KeyedValues:
    """Keyed values that ``dataclasses.asdict`` and JSON have made lists and mappings of."""
    return tuple((LimitKey(**dict(key)), float(value)) for key, value in pairs)  # type: ignore[call-overload,arg-type]
