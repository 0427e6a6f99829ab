"""Plots of a cell's effective properties: stiffness by direction, laws, strength."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gradedesign import ScalingLaw
from gradedesign.commands import COLOURS, GREY, empty_figure, save_figure
from gradedesign.fields import FloatArray
from gradedesign.properties import (
    StrengthSurface,
    hashin_shtrikman_upper,
    youngs_along,
)
from gradedesign_laboratory.directional import transverse_range

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Line of a law by how it was obtained.
_LINES = {"computed": "-", "fe": "--", "experiment": ":", "fitted": "-.", "stated": "-."}
_BLUE, _RED = COLOURS[:2]


def plot_stiffness(path: Path, stiffness: FloatArray, *, title: str) -> None:
    """Draw Young's modulus over the sphere, and E, G and Poisson's ratio in a plane.

    Parameters
    ----------
    path : Path
        PNG.
    stiffness : (6, 6) array
        Over the base material's Young's modulus.
    """
    figure = empty_figure(13.0, 9.0, title)
    _draw_sphere(figure, figure.add_subplot(2, 2, 1, projection="3d"), stiffness)
    angle = np.linspace(0, 2 * np.pi, 361)
    c, s, o = np.cos(angle), np.sin(angle), np.zeros(361)
    face, diagonal = np.stack([c, s, o]), np.stack([c / np.sqrt(2), c / np.sqrt(2), s])
    polar: Any = figure.add_subplot(2, 2, 2, projection="polar")
    polar.plot(angle, youngs_along(stiffness, face), color=_BLUE, label="from x towards y")
    polar.plot(angle, youngs_along(stiffness, diagonal), color=_RED, label="from xy diagonal to z")
    polar.set_title("E / E of the solid", fontsize=10)
    polar.legend(loc="lower right", fontsize=8, bbox_to_anchor=(1.25, -0.05))
    across = transverse_range(stiffness, face)
    shear: Any = figure.add_subplot(2, 2, 3, projection="polar")
    shear.fill_between(
        angle, across.shear_least, across.shear_greatest, color=_BLUE, alpha=0.25, linewidth=0
    )
    shear.plot(angle, across.shear_mean, color=_BLUE)
    shear.set_ylim(0, None)
    shear.set_title("G / E of the solid, from x towards y: least, mean, greatest", fontsize=10)
    poisson: Any = figure.add_subplot(2, 2, 4)
    degrees = np.degrees(angle[:91])
    poisson.fill_between(
        degrees,
        across.poisson_least[:91],
        across.poisson_greatest[:91],
        color=_BLUE,
        alpha=0.25,
        linewidth=0,
    )
    poisson.plot(degrees, across.poisson_mean[:91], color=_BLUE)
    poisson.set(xlabel="angle from x towards y [deg]", ylabel="Poisson's ratio", xlim=(0, 90))
    poisson.set_title("least, mean, greatest across", fontsize=10)
    save_figure(path, figure)


def plot_laws(
    path: Path,
    laws: Sequence[ScalingLaw],
    *,
    title: str,
    poissons_ratio: float,
    density: float,
    youngs: float,
    error: float,
) -> None:
    """Draw Young's modulus along x against density: bounds, laws, and what was computed.

    Parameters
    ----------
    path : Path
        PNG.
    poissons_ratio : float
        Of the base material, for the bounds.
    density, youngs, error : float
        The computed value and its uncertainty, over the base material's modulus.
    """
    figure = empty_figure(9.0, 7.0, title)
    axes: Any = figure.add_subplot()
    rho = np.geomspace(0.02, 0.99, 200)
    axes.plot(rho, rho, color=GREY, linewidth=1, label="Voigt")
    axes.plot(
        rho, [_bound(r, poissons_ratio) for r in rho], color="black", label="Hashin-Shtrikman"
    )
    order = sorted(laws, key=lambda law: (list(_LINES).index(law.kind), law.name))
    for k, law in enumerate(order):
        x = np.linspace(*law.window, 60)
        compliance = np.linalg.inv(np.moveaxis(law.stiffness(x), -1, 0))
        axes.plot(
            x,
            1 / compliance[:, 0, 0],
            _LINES[law.kind],
            color=COLOURS[k % len(COLOURS)],
            label=f"{law.name} ({law.kind})",
        )
    axes.errorbar([density], [youngs], [error], fmt="o", color=_RED, capsize=4, label="this result")
    axes.set(xscale="log", yscale="log", xlim=(0.02, 1.0), ylim=(1e-4, 1.0))
    axes.set(xlabel="relative density", ylabel="E along x / E of the solid")
    axes.grid(visible=True, which="both", color="#e5e5e5", linewidth=0.6)
    axes.legend(fontsize=8, loc="upper left")
    save_figure(path, figure)


def plot_strength_surface(path: Path, surface: StrengthSurface, *, title: str) -> None:
    """Draw macroscopic stresses at first yield: biaxial, axial with shear, and with pressure.

    Parameters
    ----------
    path : Path
        PNG.
    """
    figure = empty_figure(15.0, 5.6, title)
    x, y, xy = np.eye(6)[0], np.eye(6)[1], np.eye(6)[5]
    mean = np.array([1.0, 1.0, 1.0, 0, 0, 0])
    deviator = np.array([2.0, -1.0, -1.0, 0, 0, 0]) / 3
    sections = (
        (x, y, "normal stress xx", "normal stress yy"),
        (x, xy, "normal stress xx", "shear stress xy"),
        (mean, deviator, "hydrostatic stress", "stress difference xx to yy = zz"),
    )
    angle = np.linspace(0, 2 * np.pi, 721)
    for k, (first, second, across, up) in enumerate(sections):
        axes: Any = figure.add_subplot(1, 3, k + 1)
        stress = np.outer(first, np.cos(angle)) + np.outer(second, np.sin(angle))
        size = 1 / surface.local_stress(stress)
        axes.plot(size * np.cos(angle), size * np.sin(angle), color=_BLUE)
        axes.axhline(0, color=GREY, linewidth=0.6)
        axes.axvline(0, color=GREY, linewidth=0.6)
        axes.set(xlabel=f"{across} / strength", ylabel=f"{up} / strength")
        axes.locator_params(nbins=6)
    figure.text(
        0.02,
        0.01,
        f"first yield by the {surface.percentile:g}th percentile of the local von Mises stress; "
        f"error over unseen directions {100 * surface.max_error:.1f} % at most, "
        f"{100 * surface.rms_error:.1f} % rms, {100 * surface.unsafe_error:.1f} % unsafe",
        fontsize=9,
        color="#333333",
    )
    save_figure(path, figure)


def _draw_sphere(figure: Figure, axes: Any, stiffness: FloatArray) -> None:
    """Young's modulus as the distance from the origin in every direction."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    polar, around = np.meshgrid(np.linspace(0, np.pi, 91), np.linspace(0, 2 * np.pi, 181))
    n = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
    youngs = youngs_along(stiffness, n)
    scale = Normalize(0.0, float(youngs.max()))
    colour = colormaps["viridis"](scale(youngs))
    axes.plot_surface(*(youngs * n), facecolors=colour, rstride=2, cstride=2, linewidth=0)
    limit = 1.02 * float(youngs.max())
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), zlim=(-limit, limit))
    axes.set(xlabel="x", ylabel="y", zlabel="z")
    axes.set_box_aspect((1, 1, 1))
    axes.set_title("E in every direction / E of the solid", fontsize=10)
    figure.colorbar(ScalarMappable(norm=scale, cmap="viridis"), ax=axes, shrink=0.7, pad=0.12)


def _bound(rho: float, poissons_ratio: float) -> float:
    """Young's modulus of Hashin and Shtrikman's upper bounds."""
    bulk, shear = hashin_shtrikman_upper(rho, poissons_ratio)
    return 9 * bulk * shear / (3 * bulk + shear)
