"""``gradedesign cells`` and ``gradedesign materials``."""

from __future__ import annotations

from typing import Any

import typer

from gradedesign.cell.calibration import calibrate
from gradedesign.cli.show import print_json, print_table
from gradedesign.plugin.registry import Registry, build_registry, lookup


def cell_data(registry: Registry, name: str) -> dict[str, Any]:
    """Plain data of one family, with its calibrated window and its laws."""
    family = lookup(registry, "cell_families", name)
    laws = [law for law in registry.scaling_laws.values() if name in law.families]
    return {
        "name": name,
        "density_window": [round(v, 4) for v in calibrate(family).window],
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


def cells(name: str | None, *, as_json: bool) -> None:
    """Print all families, or one in full."""
    registry = build_registry()
    data = [cell_data(registry, n) for n in ([name] if name else registry.cell_families)]
    if as_json:
        print_json(data[0] if name else data)
        return
    if name:
        for key, value in data[0].items():
            if key != "laws":
                typer.echo(f"{key}: {value}")
        for law in data[0]["laws"]:
            typer.echo(f"law {law['name']} ({law['kind']}), density {law['window']}")
            typer.echo(f"  {law['source']}; {law['test']}")
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


def materials(*, as_json: bool) -> None:
    """Print the materials."""
    registry = build_registry()
    data = [
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
