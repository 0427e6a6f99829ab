"""Coupons as measured: struts, blocks, and the sheet that holds them."""

from __future__ import annotations

from dataclasses import dataclass

from gradedesign_laboratory.coupon_sheet import PlateFacts


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredStrut:
    """A strut of a sheet; lengths in mm, inclination in degrees."""

    coupon: int
    strut: int
    inclination: float
    designed: float
    width: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredBlock:
    """A block of a sheet; what was not measured is None.

    Attributes
    ----------
    density : float
        Relative density of its cells, as designed.
    size : float, mm
        Edge of a cell.
    cells : int
    designed, plates : float, mm^3
        Volume of its solid, and of its plates less the number.
    ratio : float
        See `gradedesign_laboratory.compressed_block.compressed_ratio`.
    edges : tuple of float or None, mm
        Outer edges along x, y, z.
    mass : float or None, g
    modulus, strength : float or None, MPa
    """

    coupon: int
    density: float
    size: float
    cells: int
    designed: float
    plates: float
    ratio: float
    edges: tuple[float | None, float | None, float | None]
    mass: float | None
    modulus: float | None
    strength: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Readings:
    """A sheet as filled in.

    Attributes
    ----------
    facts : PlateFacts
    machine, day : str
        That printed the plate, and when it was measured, as ISO 8601.
    gauge : float or None, mm
        Standard deviation of one measurement of a width; None where it is not stated.
    struts : tuple of MeasuredStrut
    blocks : tuple of MeasuredBlock
    """

    facts: PlateFacts
    machine: str
    day: str
    gauge: float | None
    struts: tuple[MeasuredStrut, ...]
    blocks: tuple[MeasuredBlock, ...]
