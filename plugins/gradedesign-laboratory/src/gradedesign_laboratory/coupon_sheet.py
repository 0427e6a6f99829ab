"""The sheet of a build plate: one row for every block and every strut, to be filled in by hand.

A CSV file whose first lines, after ``#``, state what was printed where, and whose header names each
column with its unit. What the plate states and what is measured stand in different columns.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from gradedesign_laboratory.coupon_plate import PlacedBlock
from gradedesign_laboratory.coupons import Struts

#: Version of the format: the first line.
FORMAT = ("# gradedesign coupons", "1")
#: What the first lines state, in their order; the last ones are filled in.
PLATE_FACTS = ("process", "material", "cell")
FILLED_FACTS = ("machine", "date", "gauge_mm")
#: Columns that the plate states, those that are filled in for struts and for blocks, and remarks.
DESIGNED = (
    "coupon", "strut", "kind", "inclination_deg", "designed_width_mm", "density", "cell_mm",
    "cells", "designed_mm3", "plates_mm3", "compressed_ratio",
)  # fmt: skip
OF_STRUTS = ("width_mm",)
OF_BLOCKS = ("x_mm", "y_mm", "z_mm", "mass_g", "modulus_MPa", "yield_MPa")
REMARKS = "remarks"
COLUMNS = (*DESIGNED, *OF_STRUTS, *OF_BLOCKS, REMARKS)
#: The same for the first line of the designed columns' checksum.
CHECK = "designed"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlateFacts:
    """Process, material and cell of a plate.

    Attributes
    ----------
    process : str
        Name of the process that is measured.
    material : str
        Name of its base material in the library.
    cell : str
        Cell family of the blocks.
    """

    process: str
    material: str
    cell: str


def sheet_text(facts: PlateFacts, blocks: Sequence[PlacedBlock], struts: Sequence[Struts]) -> str:
    """The sheet to fill in."""
    rows = [*map(_block_row, blocks), *(row for one in struts for row in _strut_rows(one))]
    stated = {name: getattr(facts, name) for name in PLATE_FACTS}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(FORMAT)
    for name, value in stated.items():
        writer.writerow((f"# {name}", value))
    for name in FILLED_FACTS:
        writer.writerow((f"# {name}", ""))
    writer.writerow((f"# {CHECK}", checksum(stated, rows)))
    writer.writerow(COLUMNS)
    writer.writerows([row.get(column, "") for column in COLUMNS] for row in rows)
    return text.getvalue()


def _block_row(placed: PlacedBlock) -> dict[str, str]:
    block = placed.block
    return {
        "coupon": f"{block.number}",
        "kind": "block",
        "density": f"{block.density:.6g}",
        "cell_mm": f"{block.size:.6g}",
        "cells": f"{block.cells}",
        "designed_mm3": f"{placed.volume:.6g}",
        "plates_mm3": f"{placed.plates:.6g}",
        "compressed_ratio": f"{placed.ratio:.6g}",
    }


def _strut_rows(struts: Struts) -> Iterable[dict[str, str]]:
    for n in range(1, struts.count + 1):
        yield {
            "coupon": f"{struts.number}",
            "strut": f"{n}",
            "kind": "strut",
            "inclination_deg": f"{struts.inclination:.6g}",
            "designed_width_mm": f"{struts.width:.6g}",
        }


def checksum(facts: Mapping[str, str], rows: Iterable[Mapping[str, str]]) -> str:
    """Of what the plate states, whatever the order of the rows and the spelling of the numbers."""
    lines = sorted("|".join(_plain(row.get(c, "")) for c in DESIGNED) for row in rows)
    stated = [f"{name}={facts[name]}" for name in PLATE_FACTS]
    return hashlib.sha256("\n".join([*stated, *lines]).encode()).hexdigest()[:16]


def _plain(text: str) -> str:
    try:
        return f"{float(text.replace(',', '.')):.6g}"
    except ValueError:
        return text
