"""Write ``cell-properties.md``: what the shipped property tables say of every cell.

python docs/make_cell_properties.py
"""

from __future__ import annotations

from importlib import import_module, metadata, resources
from pathlib import Path

import numpy as np

from gradedesign import PropertyTable, read_property_table, tabulated_law
from gradedesign.mechanics.homogenise.constants import (
    engineering_constants,
    youngs_along,
    zener_ratio,
)
from gradedesign.mechanics.material.power_fit import MOST_RESIDUAL, power_fits
from gradedesign.mechanics.material.stiffness_constants import constant_errors
from gradedesign.program.host.registry import build_registry

HEAD = """# Computed properties of the cells

Written by `python docs/make_cell_properties.py` from the property tables that the distributions of
cells ship, and held to them by a test. Stiffness over the base material's Young's modulus,
Poisson's ratio 0.3, extrapolated from two grids, the finer one of {least} to {finest} voxels
along the cell; the error is the share by which this changed C11 / C12 / C44, rounded up; of cells
that are not cubic, the whole stiffness and the constant that it changed most; one number alone is
the whole stiffness, of tables that do not state more.
Strength: macroscopic von Mises stress at first yield over the base material's strength, in the
worst direction. Cells that are not cubic: E along x / y / z. `gradedesign homogenise CELL
--density R` says all of it, [homogenisation.md](homogenisation.md) how.

| cell | densities | at | E100 | E111 | Zener | error | strength |
|---|---|---|---|---|---|---|---|
"""

FITS = """
## Power laws

`c rho^n` through Young's modulus along the softest cell axis and through strength, over those of
the base material, in the widest window of densities where one stays within {most:.0%} of the law
that sizing uses; `gradedesign cells NAME` prints them too. Outside its window a fit says nothing.

| cell | E: c | n | densities | residual | strength: c | n | densities | residual |
|---|---|---|---|---|---|---|---|---|
"""

TAIL = """
Without a table, {count} cells: {missing}.

`law = "auto"` computes a law for these during a run, where 128 voxels along the cell resolve their
walls.
"""

OFF = """
The voxels of {count} tables hold more or less than the density, as those of all struts and straight
pores did before method 3. This changes their stiffness by up to the share behind their names; their
error includes it. `gradedesign tabulate NAME --resolution 48 -o FOLDER` computes one exactly:
{names}.
"""

#: What the method of such a table says, before the share in per cent.
OFF_BY = "which changes the stiffness by up to "

#: Densities that are printed, where a table has them.
SHOWN = (0.1, 0.2, 0.3, 0.5)


def shipped_tables() -> list[PropertyTable]:
    """Every property table of the installed distributions of cells, by family."""
    found = []
    for entry in metadata.entry_points(group="gradedesign"):
        package = entry.value.split(":")[0]
        try:
            folder = resources.files(import_module(f"{package}.properties"))
        except ModuleNotFoundError:
            continue
        found += [
            read_property_table(item.read_text(encoding="utf-8"))
            for item in folder.iterdir()
            if item.name.endswith(".json")
        ]
    return sorted(found, key=lambda table: table.family)


def rows_of(table: PropertyTable) -> list[str]:
    """Lines of one cell."""
    shown = [k for k, rho in enumerate(table.density) if rho in SHOWN]
    if not shown:
        shown = [int(np.abs(table.density - 0.3).argmin())]
    lines = []
    for n, k in enumerate(shown):
        window = f"{table.density[0]:g} to {table.density[-1]:g}"
        first = (table.family, window) if n == 0 else ("", "")
        c = table.stiffness[k]
        youngs = engineering_constants(c).youngs
        diagonal = float(youngs_along(c, np.ones(3)))
        cubic = table.symmetry == "cubic"
        cells = (
            *first,
            f"{table.density[k]:g}",
            f"{youngs[0]:.4f}" if cubic else " / ".join(f"{e:.4f}" for e in youngs),
            f"{diagonal:.4f}",
            f"{zener_ratio(c):.2f}" if cubic else "",
            error_of(table, k),
            f"{table.strength[k]:.4f}",
        )
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def fit_row(table: PropertyTable) -> str:
    """Line of one cell's power laws."""
    cells = [table.family]
    for fit in power_fits(tabulated_law(table)).values():
        if fit is None:
            cells += ["", "", "none", ""]
            continue
        low, high = fit.window
        residual = f"{_percent(fit.residual)} %"
        cells += [f"{fit.c:.3f}", f"{fit.n:.3f}", f"{low:.3g} to {high:.3g}", residual]
    return "| " + " | ".join(cells) + " |"


def error_of(table: PropertyTable, k: int) -> str:
    """Error of a row's constants in per cent, rounded up."""
    whole = _percent(table.stiffness_error[k])
    known = {n: e[k] for n, e in constant_errors(table).items() if np.isfinite(e[k])}
    if not known:
        return f"{whole} %"
    if table.symmetry == "cubic":
        return " / ".join(_percent(e) for e in known.values()) + " %"
    worst = max(known, key=lambda name: known[name])
    return f"{whole} %, {worst} {_percent(known[worst])} %"


def _percent(error: float) -> str:
    return f"{np.ceil(1e3 * error) / 10:.1f}"


def text() -> str:
    """The whole page."""
    tables = shipped_tables()
    finest = np.concatenate([table.resolution for table in tables])
    known = {table.family for table in tables}
    missing = sorted(set(build_registry().cell_families) - known)
    page = HEAD.format(least=finest.min(), finest=finest.max())
    page += "\n".join(line for table in tables for line in rows_of(table)) + "\n"
    page += FITS.format(most=MOST_RESIDUAL)
    page += "\n".join(fit_row(table) for table in tables) + "\n"
    off = [
        f"{t.family} {t.method.split(OFF_BY)[1].split(' %')[0]} %"
        for t in tables
        if OFF_BY in t.method
    ]
    page += OFF.format(count=len(off), names=", ".join(off)) if off else ""
    return page + (TAIL.format(count=len(missing), missing=", ".join(missing)) if missing else "")


if __name__ == "__main__":
    Path(__file__).with_name("cell-properties.md").write_text(text(), encoding="utf-8")
