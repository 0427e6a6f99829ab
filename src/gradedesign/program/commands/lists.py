"""``gradedesign cells``, ``gradedesign materials`` and ``gradedesign processes``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import typer

from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.design.printing.process import Process
from gradedesign.design.resolve.choose_law import AUTO_KINDS
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.design.resolve.resolve_law import buckling_basis
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.mechanics.material.power_fit import (
    GIBSON_ASHBY,
    MOST_RESIDUAL,
    gibson_ashby,
    power_fits,
)
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.show import print_json, print_table, print_text

#: Quantities that power laws are fitted to, in words.
_FITTED = {"E": "E along the softest axis", "strength": "strength"}
_WINDOW_KIND = "cell-window"
#: Raised when what is stored of a window changes.
_WINDOW_VERSION = 2


def known_window(family: CellFamily) -> list[float] | None:
    """Densities over which a family exists, if they were calibrated before."""
    stored = load_arrays(_WINDOW_KIND, _window_key(family))
    return None if stored is None else [round(float(v), 4) for v in stored["window"]]


def density_window(family: CellFamily) -> list[float]:
    """Densities over which a family exists; calibrated once and then kept in the user's cache."""
    stored = known_window(family)
    if stored is not None:
        return stored
    window = np.array(calibrate(family).window)
    store_arrays(_WINDOW_KIND, _window_key(family), window=window)
    return [round(float(v), 4) for v in window]


def _law_window(laws: Sequence[ScalingLaw]) -> list[float] | None:
    """Densities of the law that a run would take: computed before measured, then the widest."""
    if not laws:
        return None
    best = min(laws, key=lambda k: (k.kind not in AUTO_KINDS, k.window[0] - k.window[1], k.name))
    return [round(float(v), 4) for v in best.window]


def _window_key(family: CellFamily) -> str:
    """Key by the code behind the shape: calling it would build tables of seconds per family."""
    return content_key(
        _WINDOW_VERSION,
        family.name,
        family.sides,
        family.period,
        family.distance,
        repr(sorted(family.parameters.items())),
        _code_digest(getattr(family.shape, "__module__", "")),
        _code_digest("gradedesign.geometry.cell.calibration"),
        _code_digest("gradedesign.fields"),
    )


@lru_cache
def _code_digest(module: str) -> str:
    """Content key of the Python files of the package that a module belongs to.

    The core's packages count one by one, other distributions' as a whole.
    """
    parts = module.split(".")
    root = ".".join(parts[:2]) if parts[0] == "gradedesign" else parts[0]
    own = import_module(root) if parts[0] == "gradedesign" else None
    loaded = own or sys.modules.get(root) or sys.modules.get(module)
    file = getattr(loaded, "__file__", None)
    if file is None:
        return content_key(module)
    path = Path(file)
    files = sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]
    return content_key(module, *(source.read_bytes() for source in files))


def cell_data(
    registry: Registry, name: str, window: Callable[[CellFamily], list[float] | None]
) -> dict[str, Any]:
    """Plain data of one family, with its window and its laws.

    Where the window of the cell itself is not known yet, that of its best law stands for it:
    ``density_window_of`` says ``cell`` or ``law``.
    """
    family = lookup(registry, "cell_families", name)
    laws = [law for law in registry.scaling_laws.values() if name in law.families]
    own = window(family)
    covered = _law_window(laws) if own is None else None
    return {
        "name": name,
        "density_window": own or covered,
        "density_window_of": "cell" if own else "law" if covered else None,
        "parameters": dict(family.parameters),
        "distance": family.distance,
        "symmetry": family.symmetry,
        "source": family.source,
        "supplied_by": registry.sources["cell_families"][name],
        "laws": [
            {
                "name": law.name,
                "kind": law.kind,
                "window": list(law.window),
                "source": law.source,
                "test": law.test,
                "coefficients": dict(law.coefficients),
                "power_fits": _fit_data(law),
                "gibson_ashby_window": _gibson_ashby_window(law),
            }
            for law in laws
        ],
    }


def _fit_data(law: ScalingLaw) -> dict[str, Any]:
    """Power laws fitted to a computed law; others state their own coefficients."""
    if law.kind != "computed":
        return {}
    return {
        quantity: None if fit is None else asdict(fit) for quantity, fit in power_fits(law).items()
    }


def _gibson_ashby_window(law: ScalingLaw) -> list[float] | None:
    """Densities that the power law fitted to a computed law covers; None without one."""
    if law.kind != "computed":
        return None
    try:
        return list(gibson_ashby(law).window)
    except DensityError:
        return None


def cells(name: str | None, *, strict_plugins: bool, as_json: bool) -> None:
    """Print all families, or one in full."""
    registry = registry_for(strict_plugins=strict_plugins)
    if name:
        data = [cell_data(registry, name, density_window)]
        for law in data[0]["laws"]:
            law["buckling"] = buckling_basis(registry.scaling_laws[law["name"]])
    else:
        data = [cell_data(registry, n, known_window) for n in registry.cell_families]
    if as_json:
        print_json(data[0] if name else data)
        return
    if name:
        _print_family(data[0])
        return
    print_table(
        "Cell families",
        ("cell", "density", "laws", "supplied by"),
        [
            (
                d["name"],
                _range(d["density_window"]) + (" *" if d["density_window_of"] == "law" else ""),
                str(len(d["laws"])),
                d["supplied_by"],
            )
            for d in data
        ],
    )

    bases = {d["density_window_of"] for d in data}
    if "law" in bases:
        typer.echo("*: of the shipped table or law; the cell itself may reach further")
    if None in bases:
        typer.echo("-: not computed yet")
    if bases - {"cell"}:
        typer.echo("'gradedesign cells NAME' finds the densities at which a cell exists")


def cell_makers(*, strict_plugins: bool, as_json: bool) -> None:
    """Print the makers that ``[lattice.own_cell]`` can name, with their options."""
    registry = registry_for(strict_plugins=strict_plugins)
    data = [
        {
            "name": maker.name,
            "options": dict(maker.options),
            "file": list(maker.suffixes),
            "source": maker.source,
            "supplied_by": registry.sources["cell_makers"][maker.name],
        }
        for maker in registry.cell_makers.values()
    ]
    if as_json:
        print_json(data)
        return
    for maker in registry.cell_makers.values():
        typer.echo(f"{maker.name}, supplied by {registry.sources['cell_makers'][maker.name]}")
        if maker.suffixes:
            typer.echo(f"  {'file':13s} {', '.join(maker.suffixes)}")
        for key, meaning in maker.options.items():
            typer.echo(f"  {key:13s} {meaning}")


def _range(window: list[float] | None) -> str:
    return "-" if window is None else f"{window[0]:.3f} to {window[1]:.3f}"


def _print_family(family: Mapping[str, Any]) -> None:
    """Print one family in full."""
    low, high = family["density_window"]
    parameters = ", ".join(f"{k} = {v:g}" for k, v in family["parameters"].items())
    typer.echo(f"{family['name']}, supplied by {family['supplied_by']}")
    typer.echo(f"  density     {low:g} to {high:g}")
    typer.echo(f"  parameters  {parameters or 'none'}")
    typer.echo(f"  symmetry    {family['symmetry']}")
    typer.echo(f"  distance    {'yes' if family['distance'] else 'no'}")
    typer.echo(f"  source      {family['source'] or 'not stated'}")
    for law in family["laws"]:
        low, high = law["window"]
        typer.echo(f"law {law['name']} ({law['kind']}), density {low:g} to {high:g}")
        for name, value in law["coefficients"].items():
            typer.echo(f"  {name} = {value:g}")
        for quantity, fit in law["power_fits"].items():
            if fit is None:
                typer.echo(f"  {quantity}: no power law follows it within {MOST_RESIDUAL:.0%}")
                continue
            low, high = fit["window"]
            typer.echo(
                f"  {_FITTED[quantity]} = {fit['c']:.3f} rho^{fit['n']:.3f} within "
                f"{fit['residual']:.1%}, density {low:.3g} to {high:.3g}"
            )
        if law["gibson_ashby_window"] is not None:
            low, high = law["gibson_ashby_window"]
            typer.echo(
                f'  law = "{GIBSON_ASHBY}" takes these, density {low:.3g} to {high:.3g}, or is '
                f"fitted anew to the densities that a case states"
            )
        typer.echo(f"  buckling: {law['buckling']}")
        typer.echo(f"  {law['source']}; {law['test']}")


def materials(*, strict_plugins: bool, as_json: bool) -> None:
    """Print the materials."""
    registry = registry_for(strict_plugins=strict_plugins)
    data: list[dict[str, Any]] = [
        {
            "name": m.name,
            "youngs_modulus_MPa": m.youngs_modulus,
            "poissons_ratio": m.poissons_ratio,
            "density_g_cm3": round(m.density * 1e9, 6),
            "yield_strength_MPa": m.yield_strength,
            "thermal_expansion_1_K": m.thermal_expansion,
            "source": m.source,
            "fatigue": [curve.data() for curve in m.fatigue],
        }
        for m in registry.materials.values()
    ]
    if as_json:
        print_json(data)
        return
    print_table(
        "Materials",
        ("material", "E GPa", "nu", "g/cm^3", "yield MPa", "1e-6/K", "source"),
        [
            (
                d["name"],
                f"{d['youngs_modulus_MPa'] / 1e3:.4g}",
                f"{d['poissons_ratio']:.3g}",
                f"{d['density_g_cm3']:.3g}",
                f"{d['yield_strength_MPa']:.4g}",
                f"{d['thermal_expansion_1_K'] * 1e6:.3g}",
                d["source"],
            )
            for d in data
        ],
    )
    for m in registry.materials.values():
        for curve in m.fatigue:
            print_text(f"S-N curve of {m.name}, {curve.words}: {curve.source}", hang=2)


#: Inclinations of struts in the list of processes, degrees.
_SHOWN_INCLINATIONS = (0.0, 45.0, 90.0)


def processes(*, strict_plugins: bool, as_json: bool) -> None:
    """Print the printing processes."""
    registry = registry_for(strict_plugins=strict_plugins)
    shelf: Sequence[Process] = list(registry.processes.values())
    if as_json:
        print_json([_process_data(process) for process in shelf])
        return
    print_table(
        "Printing processes; struts change by um at 0, 45 and 90 deg to the plate",
        ("process", "material", "struts um", "scatter um", "sizes mm", "n", "source"),
        [
            (
                process.name,
                process.material or "-",
                ", ".join(f"{1e3 * size:+.3g}" for size in _strut_sizes(process).values()) or "-",
                "-" if process.scatter is None else f"{1e3 * process.scatter:.3g}",
                "-" if process.sizes is None else "{:g}-{:g}".format(*process.sizes),
                "-" if process.samples is None else str(process.samples),
                process.source,
            )
            for process in shelf
        ],
    )


def _process_data(process: Process) -> dict[str, Any]:
    """Plain data on a process, lengths in mm."""
    return {
        **asdict(process),
        "strut_size_mm": {f"{a:g}": size for a, size in _strut_sizes(process).items()},
    }


def _strut_sizes(process: Process) -> dict[float, float]:
    """Change of the width of struts by inclination, mm; empty where it is not known."""
    known = process.strut_size or process.offset
    return {a: process.strut_size_at(a) for a in _SHOWN_INCLINATIONS} if known else {}
