"""``gradedesign coupon``: a plate of coupons with its sheet, and the record of a filled one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradedesign import CaseError, CellFamily, Material, Quantity
from gradedesign.commands import (
    ProgressLines,
    choose_law,
    lookup,
    print_files,
    print_json,
    print_table,
    print_text,
    registry_for,
    write_stl,
    write_text,
)
from gradedesign_laboratory.coupon_fit import Estimate
from gradedesign_laboratory.coupon_plate import CouponPlate, coupon_plate
from gradedesign_laboratory.coupon_readings import read_sheet
from gradedesign_laboratory.coupon_record import fitted_table, record_text
from gradedesign_laboratory.coupon_sheet import PlateFacts, sheet_text
from gradedesign_laboratory.coupons import CouponPlan, planned_coupons
from gradedesign_laboratory.fitted_coupons import CouponFit, fit_coupons

#: Names of what is written.
PLATE_NAME, SHEET_NAME = "plate.stl", "sheet.csv"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
#: Widest strut that spans and is gauged, mm; most struts on one coupon. Chosen, not measured.
_WIDEST, _MOST_STRUTS = 3.0, 9
#: Cells along a block: fewer are mostly free sides, more need large machines. Chosen, not measured.
_CELLS = (2, 12)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlateRequest:
    """Options of ``coupon`` for a plate, as typed.

    Attributes
    ----------
    cell : str
        A cell family.
    process : str
        Name of the process that is measured.
    material : str or None
        Of the library; by default that of the process.
    densities : sequence of float
        Of blocks.
    sizes : sequence of str
        Edges of their cells.
    cells, copies, struts : int
        See `CouponPlan`.
    inclinations : sequence of float
        Of struts, degrees.
    widths : sequence of str
        Of struts.
    output : Path
        Folder.
    """

    cell: str
    process: str
    material: str | None
    densities: Sequence[float]
    sizes: Sequence[str]
    cells: int
    copies: int
    inclinations: Sequence[float]
    widths: Sequence[str]
    struts: int
    output: Path
    strict_plugins: bool
    as_json: bool


def make_plate(asked: PlateRequest) -> None:
    """Write the plate and its sheet, and the case of every kind of block.

    Raises
    ------
    CaseError
        For an impossible option, an unknown cell or material, or a sheet that is there already.
    GradeDesignError
        As `coupon_plate`.
    """
    plan = _plan(asked)
    blocks, struts = planned_coupons(plan)
    sheet = asked.output / SHEET_NAME
    if sheet.exists():
        raise CaseError(
            f"{sheet} is there already and may be filled in; name another folder by -o, or move it"
        )
    registry = registry_for(strict_plugins=asked.strict_plugins)
    family: CellFamily = lookup(registry, "cell_families", asked.cell)
    if plan.cells % family.period:
        raise CaseError(
            f"--cells {plan.cells}: cell '{family.name}' repeats after {family.period} cells; "
            f"expected a multiple of that"
        )
    for density in plan.densities:
        choose_law(registry, family.name, "auto", (density, density))
    known = registry.processes.get(asked.process)
    name = asked.material or (known.material if known is not None else "")
    if not name:
        raise CaseError(
            f"no material of process '{asked.process}' is known; state one of the library by "
            f"--material, such as --material Ti-6Al-4V"
        )
    material: Material = lookup(registry, "materials", name)
    _make_folder(asked.output)
    with ProgressLines("coupon", err=True):
        plate = coupon_plate(
            blocks,
            struts,
            registry,
            asked.output,
            cell=asked.cell,
            material=material.name,
            process=asked.process,
        )
        digest = write_stl(asked.output / PLATE_NAME, plate.surface)
    facts = PlateFacts(process=asked.process, material=material.name, cell=asked.cell)
    write_text(sheet, sheet_text(facts, plate.blocks, plate.struts))
    data = _plate_data(plate, facts, material, digest, known=known is not None)
    if asked.as_json:
        print_json(data)
    else:
        _print_plate(data)
        names = [PLATE_NAME, SHEET_NAME, *(file.name for file in plate.cases)]
        print_files(asked.output, names)


def _plan(asked: PlateRequest) -> CouponPlan:
    """The plan that the options ask for, in mm and degrees."""
    if not _NAME.fullmatch(asked.process):
        raise CaseError(
            f"--process {asked.process} is no name of a process; expected lower case with dashes, "
            f"such as m290-ti64"
        )
    for option, values in (
        ("--density", asked.densities), ("--size", asked.sizes), ("--width", asked.widths),
        ("--inclination", asked.inclinations),
    ):  # fmt: skip
        if len(set(values)) < len(values):
            raise CaseError(f"{option} {values[-1]} is given twice; give it once")
    for density in asked.densities:
        if not 0.0 < density < 1.0:
            raise CaseError(f"--density {density:g}: expected a relative density between 0 and 1")
    for inclination in asked.inclinations:
        if not 0.0 <= inclination <= 90.0:
            raise CaseError(
                f"--inclination {inclination:g}: expected degrees between 0, lying on the plate, "
                f"and 90, standing on it"
            )
    if not _CELLS[0] <= asked.cells <= _CELLS[1]:
        raise CaseError(f"--cells {asked.cells}: expected {_CELLS[0]} to {_CELLS[1]} along a block")
    if not 1 <= asked.struts <= _MOST_STRUTS:
        raise CaseError(f"--struts {asked.struts}: expected 1 to {_MOST_STRUTS} on a coupon")
    return CouponPlan(
        densities=asked.densities,
        sizes=_lengths("--size", asked.sizes, 100.0),
        cells=asked.cells,
        copies=asked.copies,
        inclinations=asked.inclinations,
        widths=_lengths("--width", asked.widths, _WIDEST),
        struts=asked.struts,
    )


def _lengths(option: str, texts: Sequence[str], most: float) -> list[float]:
    """Lengths of texts such as ``4 mm``, in mm.

    Raises
    ------
    CaseError
        For one without a unit, or out of bounds.
    """
    length, values = Quantity("length", above=0.0, at_most=most), []
    for text in texts:
        try:
            values.append(length.read(text))
        except ValueError as error:
            raise CaseError(f"{option}: {error}") from None
    return values


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(
            f"cannot make folder {folder}: {error.strerror}; name another one"
        ) from error


def _plate_data(
    plate: CouponPlate, facts: PlateFacts, material: Material, digest: str, *, known: bool
) -> dict[str, Any]:
    """Plain data on a plate."""
    size = plate.surface.vertices.max(axis=0)
    return {
        "process": facts.process,
        "process_is_known": known,
        "material": facts.material,
        "cell": facts.cell,
        "sha256": digest,
        "plate_mm": [round(float(v), 3) for v in size],
        "triangles": len(plate.surface.faces),
        "blocks": [
            {
                "coupon": placed.block.number,
                "density": placed.block.density,
                "cell_mm": placed.block.size,
                "cells": placed.block.cells,
                "mass_g": round(placed.volume * material.density * 1e6, 4),
                "as_built_g": None
                if placed.as_built is None
                else round(placed.as_built * material.density * 1e6, 4),
            }
            for placed in plate.blocks
        ],
        "struts": [
            {
                "coupon": struts.number,
                "inclination_deg": struts.inclination,
                "width_mm": struts.width,
                "count": struts.count,
            }
            for struts in plate.struts
        ],
    }


def _print_plate(data: dict[str, Any]) -> None:
    """Print what stands on a plate."""
    x, y, z = data["plate_mm"]
    built = any(block["as_built_g"] is not None for block in data["blocks"])
    if data["blocks"]:
        print_table(
            f"Blocks of {data['cell']}, {data['material']}",
            ("coupon", "density", "cell mm", "cells", "mass g", "as built g"),
            [
                (
                    str(block["coupon"]),
                    f"{block['density']:g}",
                    f"{block['cell_mm']:g}",
                    str(block["cells"]),
                    f"{block['mass_g']:.4g}",
                    "-" if block["as_built_g"] is None else f"{block['as_built_g']:.4g}",
                )
                for block in data["blocks"]
            ],
        )
    if data["struts"]:
        print_table(
            "Struts",
            ("coupon", "inclination deg", "width mm", "struts"),
            [
                (
                    str(struts["coupon"]),
                    f"{struts['inclination_deg']:g}",
                    f"{struts['width_mm']:g}",
                    str(struts["count"]),
                )
                for struts in data["struts"]
            ],
        )
    print_text(f"plate of {x:.4g} x {y:.4g} x {z:.4g} mm, {data['triangles']} triangles")
    if not built:
        print_text(
            f"process '{data['process']}' is not in the library, or without an as-built body: no "
            f"mass as built is predicted",
            hang=2,
        )


def read_coupons(sheet: Path, record: Path | None, *, strict_plugins: bool, as_json: bool) -> None:
    """Fit a sheet that is filled in, print what it says, and write the record of it.

    Parameters
    ----------
    record : Path or None
        File to write; by default beside the sheet, named after the process.

    Raises
    ------
    CaseError
        For what is wrong with the sheet, or where nothing can be fitted.
    """
    readings = read_sheet(sheet)
    registry = registry_for(strict_plugins=strict_plugins)
    facts = readings.facts
    material: Material = lookup(registry, "materials", facts.material)
    lookup(registry, "cell_families", facts.cell)
    densities = [block.density for block in readings.blocks] or [0.0, 1.0]
    law = choose_law(registry, facts.cell, "auto", (min(densities), max(densities)))
    fit = fit_coupons(readings, material, law)
    text = record_text(fit)
    file = sheet.with_name(f"{facts.process}.toml") if record is None else record
    if file.suffix.lower() != ".toml":
        raise CaseError(f"-o {file}: expected a file that ends with .toml, which a case names")
    write_text(file, text)
    if as_json:
        print_json({**fitted_table(fit), "record": str(file)})
        return
    _print_fit(fit)
    print_text(f"wrote {file}; a case below whose folder it lies names it:", hang=2)
    lines = ["[process]", f'file = "{file.name}"']
    if fit.strength.estimate is not None:
        lines += ["[material]", f'file = "{file.name}"']
    for line in lines:
        print_text(f"  {line}")


def _print_fit(fit: CouponFit) -> None:
    """Print every estimate with its interval, what is not stated, and remarks."""
    readings = fit.readings
    rows: list[tuple[str, Estimate | None, float]] = [
        (f"struts at {angle:g} deg, um", size, 1e3) for angle, size in fit.struts.sizes.items()
    ]
    rows += [
        ("scatter of struts, um", fit.struts.scatter, 1e3),
        ("modulus over nominal", fit.modulus.estimate, 1.0),
        ("yield over nominal", fit.strength.estimate, 1.0),
        ("mass over designed", fit.density, 1.0),
    ]
    print_table(
        f"Process {readings.facts.process} on {readings.machine}, {readings.facts.material}, "
        f"{readings.day}",
        ("quantity", "value", "95 % from", "to", "n"),
        [
            (
                name,
                f"{scale * one.value:.4g}",
                f"{scale * one.low:.4g}",
                f"{scale * one.high:.4g}",
                str(one.count),
            )
            for name, one, scale in rows
            if one is not None
        ],
    )
    for words in fit.refused:
        print_text(f"not stated: {words}", hang=2)
    for words in fit.notes:
        print_text(f"note: {words}", hang=2)
