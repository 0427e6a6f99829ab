"""Numbers of a sheet of coupons, each checked where it stands; nothing is guessed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gradedesign import CaseError
from gradedesign.commands import shown
from gradedesign_laboratory.coupon_sheet import OF_BLOCKS, OF_STRUTS
from gradedesign_laboratory.measured_coupons import MeasuredBlock, MeasuredStrut

#: Problems that a message lists. Chosen, not measured.
_LISTED = 20
_NUMBER = re.compile(r"[+-]?(\d{1,15}([.,]\d{0,15})?|[.,]\d{1,15})([eE][+-]?\d{1,2})?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([.,' ]\d{3})+([.,]\d*)?")
#: Measured over designed values, least and most: beyond, a unit is wrong. Chosen, not measured.
_LEAST_SHARE, _MOST_SHARE = 0.2, 5.0


@dataclass(slots=True)
class Problems:
    """Problems of a sheet, by line."""

    name: str
    found: list[str] = field(default_factory=list)

    def add(self, line: int, words: str) -> None:
        """Note a problem."""
        self.found.append(f"{self.name}:{line}: {words}")

    def require_none(self) -> None:
        """Raise CaseError that lists all problems, if there are any."""
        if not self.found:
            return
        listed = "\n".join(self.found[:_LISTED])
        more = len(self.found) - _LISTED
        end = f"\nand {more} more" if more > 0 else ""
        raise CaseError(f"{len(self.found)} problems in {self.name}\n{listed}{end}")


@dataclass(frozen=True, slots=True)
class Numbers:
    """Reads the numbers of a sheet; what is wrong with one is a problem of its line."""

    problems: Problems
    comma: bool

    def whole(self, line: int, row: Mapping[str, str], column: str) -> int:
        """A number from 1 to 99; 0 where it is none."""
        text = row[column]
        if not (text.isascii() and text.isdecimal() and 1 <= int(text[:4]) <= 99):
            self.problems.add(line, f"{column}: found {shown(text)}; expected a number from 1")
            return 0
        return int(text)

    def value(self, line: int, name: str, text: str, wanted: float | None = None) -> float | None:
        """A number above 0, or None where the cell is blank.

        ``wanted`` is the designed value, which it may not leave by more than a factor.
        """
        if not text:
            return None
        words = self._refused(text)
        number = 0.0 if words else float(text.replace(",", "."))
        if not words and not number > 0.0:
            words = "expected a number above 0, or a blank where nothing was measured"
        if not words and wanted and not _LEAST_SHARE <= number / wanted <= _MOST_SHARE:
            words = f"the designed value is {wanted:.4g}; is its unit that of the column?"
        if words:
            self.problems.add(line, f"{name}: found {shown(text)}; {words}")
            return None
        return number

    def _refused(self, text: str) -> str:
        """Why a text is no number; empty where it is one."""
        if text[0] in "=@" or text[:2] in ("+=", "-=", "+@"):
            return "a formula; save the sheet with values"
        if not text.isascii() or not _NUMBER.fullmatch(text):
            if _THOUSANDS.fullmatch(text):
                return "expected a number without separators of thousands"
            return "expected a number alone, in the unit of the column"
        if self.comma and "." in text:
            return (
                "other numbers of the sheet have decimal commas, so that the point may part "
                "thousands; expected one of them throughout"
            )
        return ""

    def gauge(self, facts: Mapping[str, tuple[int, str]]) -> float | None:
        """Standard deviation of the gauge, mm."""
        line, text = facts["gauge_mm"]
        return self.value(line, "gauge_mm", text)

    def strut(self, line: int, row: Mapping[str, str], coupon: int, strut: int) -> MeasuredStrut:
        """A strut of a row."""
        self._only(line, row, OF_BLOCKS, "strut")
        designed = self._designed(line, row, "designed_width_mm")
        return MeasuredStrut(
            coupon=coupon,
            strut=strut,
            inclination=self._designed(line, row, "inclination_deg", zero=True),
            designed=designed,
            width=self.value(line, "width_mm", row["width_mm"], designed),
        )

    def block(self, line: int, row: Mapping[str, str], coupon: int) -> MeasuredBlock:
        """A block of a row."""
        self._only(line, row, OF_STRUTS, "block")
        size = self._designed(line, row, "cell_mm")
        cells = self.whole(line, row, "cells")
        edge = cells * size or None
        x, y, z = (self.value(line, f"{k}_mm", row[f"{k}_mm"], edge) for k in "xyz")
        return MeasuredBlock(
            coupon=coupon,
            density=self._designed(line, row, "density"),
            size=size,
            cells=cells,
            designed=self._designed(line, row, "designed_mm3"),
            plates=self._designed(line, row, "plates_mm3"),
            ratio=self._designed(line, row, "compressed_ratio"),
            edges=(x, y, z),
            mass=self.value(line, "mass_g", row["mass_g"]),
            modulus=self.value(line, "modulus_MPa", row["modulus_MPa"]),
            strength=self.value(line, "yield_MPa", row["yield_MPa"]),
        )

    def _designed(
        self, line: int, row: Mapping[str, str], column: str, *, zero: bool = False
    ) -> float:
        """A number that the plate stated; 0 where it is none."""
        text = row[column]
        if zero and _NUMBER.fullmatch(text) and float(text.replace(",", ".")) == 0.0:
            return 0.0
        if not text:
            self.problems.add(line, f"{column}: blank; expected it as the plate stated it")
            return 0.0
        return self.value(line, column, text) or 0.0

    def _only(self, line: int, row: Mapping[str, str], others: Sequence[str], kind: str) -> None:
        """Refuse values in columns of the other kind, or beyond all columns."""
        for column in (*others, ""):
            if row.get(column):
                where = f"{column} does not belong to a {kind}" if column else "beyond the columns"
                self.problems.add(line, f"{where}: found {shown(row[column])}; expected a blank")
