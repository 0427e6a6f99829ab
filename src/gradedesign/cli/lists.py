"""``gradedesign cells`` and ``gradedesign materials``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import typer

from gradedesign.cell.calibration import calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import evaluate_shape
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.show import print_json, print_table
from gradedesign.plugin.registry import Registry, lookup
from gradedesign.workspace.cache import content_key, load_arrays, store_arrays

_WINDOW_KIND = "cell-window"
#: Raised when calibration changes what a window is.
_WINDOW_VERSION = 1


def density_window(family: CellFamily) -> list[float]:
    """Densities over which a family exists; calibrated once and then kept in the user's cache."""
    points = np.random.default_rng(3141).uniform(size=(3, 4096))
    values = evaluate_shape(family, family.parameters, points)
    key = content_key(_WINDOW_VERSION, family.name, family.sides, family.distance, values)
    stored = load_arrays(_WINDOW_KIND, key)
    if stored is None:
        stored = {"window": np.array(calibrate(family).window)}
        store_arrays(_WINDOW_KIND, key, window=stored["window"])
    return [round(float(v), 4) for v in stored["window"]]


def cell_data(registry: Registry, name: str) -> dict[str, Any]:
    """Plain data of one family, with its calibrated window and its laws."""
    family = lookup(registry, "cell_families", name)
    laws = [law for law in registry.scaling_laws.values() if name in law.families]
    return {
        "name": name,
        "density_window": density_window(family),
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
            }
            for law in laws
        ],
    }


def cells(name: str | None, *, strict_plugins: bool, as_json: bool) -> None:
    """Print all families, or one in full."""
    registry = registry_for(strict_plugins=strict_plugins)
    data = [cell_data(registry, n) for n in ([name] if name else registry.cell_families)]
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
                f"{d['density_window'][0]:.3f} to {d['density_window'][1]:.3f}",
                str(len(d["laws"])),
                d["supplied_by"],
            )
            for d in data
        ],
    )


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
