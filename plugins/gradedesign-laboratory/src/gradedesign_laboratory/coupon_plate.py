"""The build plate of coupons: their surfaces, by the path of every run, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign import CaseError, Material, SurfaceMesh, load_case, report_step
from gradedesign.commands import (
    Registry,
    counted,
    difference,
    fitting_part,
    lookup,
    stated_lattice,
    stated_print,
    toml_text,
    write_text,
)
from gradedesign.properties import calibrate
from gradedesign_laboratory.compressed_block import compressed_ratio
from gradedesign_laboratory.coupon_shapes import DEPTH, NUMBER_SIZE, engraving, strut_coupon
from gradedesign_laboratory.coupons import Block, Struts

#: Solid plates above and below the cells of a block, mm: three times the depth of its number.
PLATE = 3.0 * DEPTH
#: Room between coupons, and length of a row of them, mm. Chosen, not measured.
_GAP, _ROW = 4.0, 120.0
#: Chord tolerance of blocks, mm: half as many triangles, less than any process is measured to.
_CHORD = 0.005
#: Edge of a block beyond its number, mm.
_AROUND = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedBlock:
    """A block as designed.

    Attributes
    ----------
    volume : float, mm^3
        Of its printed surface, with plates and number.
    plates : float, mm^3
        Of its solid plates, less the number.
    as_built : float or None, mm^3
        Volume of the as-built body, where the process is known.
    ratio : float
        Its modulus between plates over that of the periodic lattice, see `compressed_ratio`.
    """

    block: Block
    volume: float
    plates: float
    as_built: float | None
    ratio: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CouponPlate:
    """A plate of coupons.

    Attributes
    ----------
    surface : SurfaceMesh
        Closed, of all coupons; disconnected from each other.
    blocks : tuple of PlacedBlock
    struts : tuple of Struts
    cases : tuple of Path
        Case files of the blocks, each without a number.
    """

    surface: SurfaceMesh
    blocks: tuple[PlacedBlock, ...]
    struts: tuple[Struts, ...]
    cases: tuple[Path, ...]


def coupon_plate(
    blocks: Sequence[Block],
    struts: Sequence[Struts],
    registry: Registry,
    folder: Path,
    *,
    cell: str,
    material: str,
    process: str,
) -> CouponPlate:
    """Make the surfaces of all coupons and lay them side by side.

    Raises
    ------
    CaseError
        If a block is too small for its number, or its case is impossible.
    GradeDesignError
        Whatever the cell or its surface is refused for.

    Parameters
    ----------
    folder : Path
        Where the case files of the blocks are written.
    cell, material : str
        Names of the library.
    process : str
        Its as-built bodies are predicted where the library has it.
    """
    smallest = min((block.edge for block in blocks), default=np.inf)
    if smallest < max(NUMBER_SIZE) + 2.0 * _AROUND:
        raise CaseError(
            f"a block of {blocks[0].cells} cells has an edge of {smallest:g} mm, its number needs "
            f"{max(NUMBER_SIZE) + 2.0 * _AROUND:g} mm; state more cells or larger ones"
        )
    found: Material = lookup(registry, "materials", material)
    known = process if process in registry.processes else None
    plain: dict[tuple[float, float], _PlainBlock] = {}
    for block in counted(blocks, "block", len(blocks)):
        key = (block.density, block.size)
        if key not in plain:
            data = block_case(block, cell=cell, material=found.name, process=known)
            plain[key] = _plain_block(block, data, registry, folder, found.poissons_ratio)
    numbered = [_numbered(block, plain[block.density, block.size]) for block in blocks]
    surfaces = [*(surface for _, surface in numbered), *map(strut_coupon, struts)]
    return CouponPlate(
        surface=_side_by_side(surfaces),
        blocks=tuple(placed for placed, _ in numbered),
        struts=tuple(struts),
        cases=tuple(one.file for one in plain.values()),
    )


def _numbered(block: Block, plain: _PlainBlock) -> tuple[PlacedBlock, SurfaceMesh]:
    """A block with its number, and its surface."""
    edge = block.edge
    number = engraving(block.number, (edge / 2.0, edge / 2.0), edge + 2.0 * PLATE)
    surface = difference(plain.surface, number, subject=f"coupon {block.number}")
    engraved = plain.volume - _volume(surface)
    placed = PlacedBlock(
        block=block,
        volume=plain.volume - engraved,
        plates=2.0 * PLATE * edge**2 - engraved,
        as_built=None if plain.as_built is None else plain.as_built - engraved,
        ratio=plain.ratio,
    )
    return placed, surface


def block_case(block: Block, *, cell: str, material: str, process: str | None) -> Mapping[str, Any]:
    """Case of a block without its number, as its file states it."""

    def lengths(*values: float) -> list[str]:
        return [f"{value:.10g} mm" for value in values]

    edge, height = block.edge, block.edge + 2.0 * PLATE
    plates = [
        {"box": {"lower": lengths(0.0, 0.0, low), "upper": lengths(edge, edge, high)}}
        for low, high in ((0.0, PLATE), (height - PLATE, height))
    ]
    data: dict[str, Any] = {
        "case": {"name": f"{cell} {block.density:g} {block.size:g} mm"},
        "part": {"box": lengths(edge, edge, height)},
        "keep": plates,
        "material": {"name": material},
        "lattice": {
            "cell": cell,
            "size": f"{block.size:.10g} mm",
            "density": block.density,
            "origin": lengths(0.0, 0.0, PLATE),
        },
        "print": {"chord_tolerance": f"{_CHORD:g} mm"},
    }
    if process is not None:
        data["process"] = {"name": process}
    return data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _PlainBlock:
    """A block without a number; volumes in mm^3."""

    file: Path
    surface: SurfaceMesh
    volume: float
    as_built: float | None
    ratio: float


def _plain_block(
    block: Block, data: Mapping[str, Any], registry: Registry, folder: Path, poissons_ratio: float
) -> _PlainBlock:
    """A block whose surface is made by the path of a run of stated density, and its stiffness."""
    file = folder / f"block-{data['lattice']['density']:g}-{data['lattice']['size']}.toml"
    file = file.with_name(file.name.replace(" ", ""))
    write_text(file, toml_text(data))
    case, part = fitting_part(load_case(file, registry=registry), registry)
    made = stated_print(stated_lattice(case, registry, part))
    built = None if made.surface is None else made.surface.built
    report_step(f"modulus of blocks of density {block.density:g}")
    family = registry.cell_families[data["lattice"]["cell"]]
    ratio = compressed_ratio(
        calibrate(family, {}),
        block.density,
        block.cells,
        plate=PLATE / block.size,
        poissons_ratio=poissons_ratio,
    )
    return _PlainBlock(
        file=file,
        surface=made.lattice.surface,
        volume=made.volume,
        as_built=None if built is None else _volume(built.surface),
        ratio=ratio,
    )


def _volume(surface: SurfaceMesh) -> float:
    """Enclosed volume, mm^3."""
    a, b, c = np.moveaxis(surface.vertices[surface.faces] - surface.vertices.mean(axis=0), 1, 0)
    return float(np.einsum("mi,mi->", a, np.cross(b, c)) / 6.0)


def _side_by_side(surfaces: Sequence[SurfaceMesh]) -> SurfaceMesh:
    """Coupons in rows on the plate z = 0, in the order of their numbers."""
    vertices, faces, first = [], [], 0
    x = y = depth = 0.0
    for surface in surfaces:
        lower, size = surface.vertices.min(axis=0), np.ptp(surface.vertices, axis=0)
        if x > 0.0 and x + size[0] > _ROW:
            x, y, depth = 0.0, y + depth + _GAP, 0.0
        vertices.append(surface.vertices - lower + [x, y, 0.0])
        faces.append(surface.faces + first)
        first += len(surface.vertices)
        x, depth = x + float(size[0]) + _GAP, max(depth, float(size[1]))
    return SurfaceMesh(vertices=np.concatenate(vertices), faces=np.concatenate(faces))
