"""Coupons of a cell and a process: which there are, and their numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from gradedesign import CaseError

#: Coupons of one plate: their numbers have two digits.
MOST_COUPONS = 99


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A cube of cells between two solid plates, to be weighed and compressed.

    Attributes
    ----------
    number : int
        Engraved in its upper plate.
    density : float
        Relative density of the cells.
    size : float, mm
        Edge of a cell.
    cells : int
        Along each edge.
    """

    number: int
    density: float
    size: float
    cells: int

    @property
    def edge(self) -> float:
        """Edge of the cube of cells, mm."""
        return self.cells * self.size


@dataclass(frozen=True, slots=True, kw_only=True)
class Struts:
    """Round struts of one width and inclination on a base, whose width is measured.

    Attributes
    ----------
    number : int
        Engraved in its base.
    inclination : float, degrees
        Of their axes to the plate.
    width : float, mm
    count : int
        Struts, counted from the side of the number's underline.
    """

    number: int
    inclination: float
    width: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CouponPlan:
    """Coupons that a plate holds.

    Attributes
    ----------
    densities : sequence of float
        Of blocks.
    sizes : sequence of float, mm
        Of their cells.
    cells : int
        Along an edge of a block.
    copies : int
        Blocks of each density and size, and coupons of each strut.
    inclinations : sequence of float, degrees
        Of struts.
    widths : sequence of float, mm
        Of struts.
    struts : int
        On each coupon.
    """

    densities: Sequence[float]
    sizes: Sequence[float]
    cells: int
    copies: int
    inclinations: Sequence[float]
    widths: Sequence[float]
    struts: int


def planned_coupons(plan: CouponPlan) -> tuple[tuple[Block, ...], tuple[Struts, ...]]:
    """Blocks, then struts, numbered from 1.

    Raises
    ------
    CaseError
        If there are more than numbers.
    """
    of_blocks = list(product(plan.densities, plan.sizes, range(plan.copies)))
    of_struts = list(product(plan.inclinations, plan.widths))
    count = len(of_blocks) + len(of_struts)
    if count > MOST_COUPONS:
        raise CaseError(
            f"the plate would hold {count} coupons, expected at most {MOST_COUPONS}, whose numbers "
            f"have two digits; state fewer densities, sizes, copies, inclinations or widths"
        )
    blocks = tuple(
        Block(number=n, density=density, size=size, cells=plan.cells)
        for n, (density, size, _) in enumerate(of_blocks, start=1)
    )
    struts = tuple(
        Struts(number=n, inclination=inclination, width=width, count=plan.struts)
        for n, (inclination, width) in enumerate(of_struts, start=len(blocks) + 1)
    )
    return blocks, struts
