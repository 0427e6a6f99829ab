"""``gradedesign check`` of a case that states the density of its lattice."""

from __future__ import annotations

import numpy as np

from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.fitting_part import fitting_part
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.stated_lattice import StatedLattice, stated_lattice
from gradedesign.design.verdict.stated_result import cell_data
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.part.file_faces import file_body_words
from gradedesign.geometry.part.round_shapes import round_shapes
from gradedesign.program.commands.check_data import part_data, region_data
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_json, print_text, print_warnings
from gradedesign.program.commands.show_part import (
    part_words,
    print_file_faces,
    print_holes,
    print_regions,
    repair_words,
)


def check_stated(case: Case, registry: Registry, *, estimate: bool, as_json: bool) -> int:
    """Read, repair, place the cells and their densities; nothing is contoured or written.

    Raises CaseError if an estimate is asked for.
    """
    if estimate:
        raise CaseError(
            f"{case.where('lattice')}: --estimate sizes a lattice, and the density of this one is "
            f"stated; leave it out, or state density = [lowest, highest]"
        )
    with ProgressLines("check", err=True):
        stated = stated_lattice(case, registry, fitting_part(case, registry)[1])
    if as_json:
        print_json(_data(stated))
        return 0
    part, material = stated.part, stated.material
    solid = "" if material is None else f", {material.density * part.volume * 1e6:.4g} g if solid"
    print_text(f"case: {case.name}")
    print_text(f"{part_words(part)}{solid}", hang=2)
    for line in (*file_body_words(part.file_bodies), repair_words(part)):
        print_text(line, hang=2)
    print_regions(part, part.regions)
    print_holes(part, round_shapes(part.surface, part.faces))
    print_file_faces(part)
    low, high = _densities(stated)
    window = stated.cells.window
    print_text(
        f"cell: {case.lattice.cell}, {case.lattice.size_words}; it can be printed from density "
        f"{window[0]:.3g} to {window[1]:.3g}",
        hang=2,
    )
    between = f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
    print_text(
        f"stated density: {between}; thinnest wall {stated.wall:.3g} mm; a run ends with this "
        f"lattice and analyses nothing",
        hang=2,
    )
    print_warnings(stated.warnings)
    return 0


def _densities(stated: StatedLattice) -> tuple[float, float]:
    """Lowest and highest density of a lattice."""
    density = stated.design.density
    values = density.values if isinstance(density, DensityGrid) else np.array([density])
    return float(values.min()), float(values.max())


def _data(stated: StatedLattice) -> dict[str, object]:
    return {
        "case": stated.case.name,
        "part": part_data(stated.part, stated.material),
        "regions": region_data(stated.part.regions),
        "cell": cell_data(stated),
        "density": list(_densities(stated)),
        "cell_map": dict(stated.cell_map),
        "transition": dict(stated.transition),
        "warnings": list(stated.warnings),
    }
