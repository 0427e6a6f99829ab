"""Cells on triply periodic minimal surfaces for gradedesign, with scaling laws of some."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import (
    CellFamily,
    ScalingLaw,
    hookimpl,
    shipped_laws,
)
from gradedesign_cells_tpms import (
    c_y,
    diamond,
    diamond_raymont,
    fischer_koch_s,
    frd,
    gyroid,
    gyroid_raymont,
    iwp,
    lidinoid,
    neovius,
    neovius_as_printed,
    pinched_primitive,
    pm_y,
    primitive,
    split_p,
)
from gradedesign_cells_tpms.laws import scaling_laws


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register sheet, networks and wall of every surface."""
    for surface in (
        c_y, diamond, diamond_raymont, fischer_koch_s, frd, gyroid, gyroid_raymont, iwp,
        lidinoid, neovius, neovius_as_printed, pinched_primitive, pm_y, primitive, split_p,
    ):  # fmt: skip
        yield from surface.FAMILIES


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register laws from the literature and from homogenisation."""
    yield from scaling_laws()
    yield from shipped_laws(f"{__name__}.properties")
