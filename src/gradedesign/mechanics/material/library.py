"""Printed alloys and polymers of ``materials.toml``, each with the source of every figure."""

from __future__ import annotations

import tomllib
from importlib import resources

from gradedesign.mechanics.material.fatigue_curve import FatigueCurve
from gradedesign.mechanics.material.material import Material


def builtin_materials() -> tuple[Material, ...]:
    """Return the materials that come with gradedesign, sorted by name."""
    text = resources.files(__package__).joinpath("materials.toml").read_text("utf-8")
    made = (
        Material(
            name=name,
            youngs_modulus=stated["modulus"] * 1e3,
            poissons_ratio=stated["nu"],
            density=stated["density"] * 1e-9,
            yield_strength=stated["strength"],
            thermal_expansion=stated["expansion"] * 1e-6,
            source=stated["source"],
            fatigue=tuple(_curve(**curve) for curve in stated.get("fatigue", ())),
        )
        for name, stated in tomllib.loads(text).items()
    )
    return tuple(sorted(made, key=lambda material: material.name))


def _curve(
    cycles: list[float], amplitude: list[float], surface: str, ratio: float, source: str
) -> FatigueCurve:
    """An S-N curve from lists of TOML."""
    return FatigueCurve(
        surface=surface,
        ratio=ratio,
        cycles=tuple(cycles),
        amplitude=tuple(amplitude),
        source=source,
    )
