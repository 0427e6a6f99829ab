"""The effective properties of a cell as tables for reading."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gradedesign.commands import print_table, print_text


def print_properties(data: Mapping[str, Any]) -> None:
    """Print a result for reading; moduli in per cent of the base material's E."""
    print_text(
        f"{data['cell']} at relative density {data['density']:g}, Poisson's ratio "
        f"{data['poissons_ratio']:g}, {data['resolution']}^3 and {data['resolution'] // 2}^3 voxels"
    )
    print_text("moduli in % of the base material's Young's modulus")
    print_table(
        f"Stiffness C (engineering shear), right to {data['stiffness_error']:.1%}; "
        f"to {data['energy_error']:.1%} in the strain that it knows least",
        ("", *data["voigt_order"]),
        [
            (name, *(f"{100 * v:.4f}" for v in row))
            for name, row in zip(data["voigt_order"], data["C"], strict=True)
        ],
    )
    print_table(
        "Error of each constant",
        tuple(data["constant_errors"]),
        [tuple(f"{error:.1%}" for error in data["constant_errors"].values())],
    )
    _print_engineering(data)
    _print_averages(data)
    print_table(
        "Bounds",
        ("bound", "value", "limit", ""),
        [
            (
                bound["name"],
                f"{100 * bound['value']:.4f}",
                "above 0" if bound["upper"] is None else f"{100 * bound['upper']:.4f}",
                "holds" if bound["holds"] else "BROKEN",
            )
            for bound in data["bounds"]
        ],
    )
    _print_strength(data["strength"])
    if "conductivity" in data:
        conductivity = data["conductivity"]
        rows = [[f"{100 * v:.3f}" for v in row] for row in conductivity["value"]]
        print_table(
            f"Conductivity in % of the base material's, right to {conductivity['error']:.1%}, "
            f"bound {100 * conductivity['isotropic_bound']:.3f} where isotropic",
            ("", "x", "y", "z"),
            [(name, *row) for name, row in zip("xyz", rows, strict=True)],
        )
    if "buckling" in data:
        _print_buckling(data["buckling"])
    if data["laws"]:
        print_table(
            "E along x by other laws",
            ("law", "kind", "E x", "source"),
            [
                (law["name"], law["kind"], f"{100 * law['E_x']:.3f}", law["source"])
                for law in data["laws"]
            ],
        )
    for path in data.get("files", ()):
        print_text(f"wrote {path}")


def print_block(data: Mapping[str, Any]) -> None:
    """Print the apparent stiffness of a finite block for reading, beside the periodic one."""
    low, high = data["energy_over_periodic"]
    piece = "the inscribed tetrahedron of " if data["boundary"] == "macro-tet" else ""
    void = data["void_stiffness"]
    print_text(
        f"{data['cell']} at relative density {data['density']:g}, Poisson's ratio "
        f"{data['poissons_ratio']:g}: boundary {data['boundary']} on {piece}{data['cells']}^3 "
        f"cells of {data['resolution']}^3 voxels, "
        f"{data['solid_volume_fraction']:.4g} of them solid, "
        f"void {'with ' + format(void, 'g') + ' of the stiffness' if void else 'empty'}"
    )
    print_text("moduli in % of the base material's Young's modulus; nothing is extrapolated")
    for title, stiffness in (("this block", data), ("the periodic lattice", data["periodic"])):
        print_table(
            f"Stiffness C of {title} (engineering shear)",
            ("", *data["voigt_order"]),
            [
                (name, *(f"{100 * v:.4f}" for v in row))
                for name, row in zip(data["voigt_order"], stiffness["C"], strict=True)
            ],
        )
        _print_engineering(stiffness)
    _print_averages(data)
    order = {True: "; it keeps its side of it, as proved", False: "; WRONG SIDE of it", None: ""}
    print_text(
        f"strain energy over the periodic lattice's on the same voxels: {low:.4f} to {high:.4f}"
        f"{order[data['in_order']]}"
    )


def _print_engineering(data: Mapping[str, Any]) -> None:
    """Print moduli and Poisson's ratios along the axes."""
    moduli = data["engineering"]
    print_table(
        "Engineering constants",
        ("E x", "E y", "E z", "G yz", "G xz", "G xy", "nu yz", "nu xz", "nu xy"),
        [
            (
                *(f"{100 * v:.3f}" for v in (*moduli["E"].values(), *moduli["G"].values())),
                *(f"{v:.3f}" for v in moduli["nu"].values()),
            )
        ],
    )


def _print_averages(data: Mapping[str, Any]) -> None:
    """Print directions and isotropic averages."""
    youngs, means = data["youngs"], data["averages"]
    print_table(
        "Young's modulus by direction",
        ("<100>", "<110>", "<111>", "least", "along", "greatest", "along"),
        [
            (
                *(f"{100 * youngs[k]:.3f}" for k in ("100", "110", "111", "least")),
                str(youngs["least_along"]),
                f"{100 * youngs['greatest']:.3f}",
                str(youngs["greatest_along"]),
            )
        ],
    )
    print_table(
        f"Averages over all orientations (Zener ratio {data['zener']:.3f}, Hill's E "
        f"{100 * means['hill_youngs']:.3f}, nu {means['hill_poisson']:.3f})",
        ("modulus", "Voigt", "Reuss", "Hill"),
        [
            (name, *(f"{100 * means[name][k]:.4f}" for k in ("voigt", "reuss", "hill")))
            for name in ("bulk", "shear")
        ],
    )


def _print_strength(strength: Mapping[str, Any]) -> None:
    """Print how far the cell multiplies stress."""
    print_table(
        f"Strength {100 * strength['value']:.3f} % of the base material's, changed by "
        f"{strength['error']:.1%} from half the resolution; local stress per macroscopic stress "
        f"({strength['percentile']:g}th percentile by volume)",
        ("macroscopic stress", "factor"),
        [(name, f"{value:.3f}") for name, value in strength["factors"].items()],
    )
    if "surface" in strength:
        surface = strength["surface"]
        print_text(
            f"strength surface: exponent {surface['exponent']}, {surface['terms']} terms, error "
            f"{surface['max_error']:.1%} at most, {surface['rms_error']:.1%} rms, "
            f"{surface['unsafe_error']:.1%} unsafe"
        )


def _print_buckling(buckling: Mapping[str, Any]) -> None:
    """Print the stresses that buckle the cell."""
    print_table(
        f"Critical stresses in % of the base material's Young's modulus, each acting alone, on "
        f"{buckling['resolution']}^3 and {buckling['resolution'] // 2}^3 voxels; up to "
        f"{buckling['error']:.0%} by extrapolation",
        ("stress", "negative", "positive"),
        [
            (
                row["component"],
                *(
                    f"{100 * row[sense]:.4f} " + _mode_text(cells)
                    for sense, cells in zip(("negative", "positive"), row["cells"], strict=True)
                ),
            )
            for row in buckling["critical"]
        ],
    )
    print_table(
        "The same in waves of many cells, from the stiffness; the lesser governs",
        ("stress", "negative", "positive"),
        [
            (row["component"], *("none" if v is None else f"{100 * v:.4f}" for v in values))
            for row in buckling["critical"]
            for values in (row["long_waves"],)
        ],
    )


def _mode_text(cells: int) -> str:
    """After how many cells a mode repeats."""
    return {0: "or more", 1: "(repeats in every cell)"}.get(cells, f"(repeats after {cells} cells)")
