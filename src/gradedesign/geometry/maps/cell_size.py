"""``size`` of ``[lattice]``: the edges of a cell."""

from __future__ import annotations

import re

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.value_types import JsonSchema, Quantity, Reader, Refused

#: Edges of a cell, mm: from what the finest printers draw to what fills a room. Chosen, not
#: measured.
_CELL_SPAN = (1e-3, 1e5)


#: A range as people write it: "4-8 mm", "4 to 8 mm".
_RANGE = re.compile(
    r"\s*(?P<low>[\d.]{1,9})\s*(?:-|to|\.\.)\s*(?P<high>[\d.]{1,9})\s*(?P<unit>[a-z]{1,6})\s*"
)


class CellSize(Reader):
    """One length, a range, or the three edges of the cell."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, ...]:
        """Convert ``"8 mm"``, ``["40 mm", "50 mm"]`` or ``["8 mm", "8 mm", "12 mm"]``."""
        reader = Quantity("length", at_least=_CELL_SPAN[0], at_most=_CELL_SPAN[1])
        if isinstance(value, str) and (ends := _RANGE.fullmatch(value)):
            unit = ends["unit"]
            raise Refused(
                f"found {shown(value)}, which is no length; expected one, or a range as a list: "
                f'["{ends["low"]} {unit}", "{ends["high"]} {unit}"]'
            )
        if not isinstance(value, list):
            return (reader.read(value),)
        if len(value) not in (2, 3):
            raise Refused(
                f"found {shown(value)}; expected one length, a range such as "
                '["40 mm", "50 mm"], or three edges such as ["8 mm", "8 mm", "12 mm"]'
            )
        lengths = tuple(reader.read(v) for v in value)
        if len(lengths) == 2 and not lengths[0] < lengths[1]:
            raise Refused(
                f"found {lengths[0]:g} to {lengths[1]:g} mm; expected the smallest size first"
            )
        return lengths

    def json_schema(self) -> JsonSchema:
        """One string, two or three."""
        length = Quantity("length", at_least=_CELL_SPAN[0], at_most=_CELL_SPAN[1]).json_schema()
        return {"anyOf": [length, {"type": "array", "items": length, "minItems": 2, "maxItems": 3}]}
