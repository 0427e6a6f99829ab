"""Surface and mean curvature of cells against solids whose values are known."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell_surface import cell_surface
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.program.host.registry import build_registry


@dataclass(eq=False)
class Alone:
    """A solid in every cell that need not touch those beside it, as calibrated cells must."""

    family: CellFamily
    level_of: Callable
    name: str = "by-hand"
    window: tuple = (0.02, 0.4)
    neck: tuple = (0.5, 0.5, 0.5)
    parameters: dict = field(default_factory=dict)


def alone(shape, level_of):
    return Alone(CellFamily(name="by-hand", shape=shape, source="by hand"), level_of)


def centred(u):
    return u - np.floor(u) - 0.5


def test_sphere_has_its_surface_and_curvature():
    def radius(rho):
        return np.cbrt(3 * np.asarray(rho) / (4 * np.pi))

    sphere = alone(lambda u: np.linalg.norm(centred(u), axis=0), radius)
    projections, curvature = cell_surface(sphere, 0.2, 1.0)
    # Seen along three axes, both sides: 6 pi r^2; integral of 1 / r over the sphere: 4 pi r.
    assert projections == pytest.approx(6 * np.pi * radius(0.2) ** 2, rel=5e-3)
    assert curvature == pytest.approx(4 * np.pi * radius(0.2), rel=5e-3)


def test_wall_has_two_faces_and_no_curvature():
    wall = alone(lambda u: np.abs(centred(u)[0]), lambda rho: 0.5 * np.asarray(rho))
    projections, curvature = cell_surface(wall, 0.2, 4.0)
    assert projections == pytest.approx(2.0 / 4.0, rel=1e-12)
    assert curvature == pytest.approx(0.0, abs=1e-12)


def test_rod_is_seen_along_two_axes():
    def radius(rho):
        return np.sqrt(np.asarray(rho) / np.pi)

    rod = alone(lambda u: np.hypot(*centred(u)[:2]), radius)
    projections, curvature = cell_surface(rod, 0.2, 2.0)
    # Two axes, both sides: 8 r for every length, in cells of 2 mm.
    assert projections == pytest.approx(8 * radius(0.2) / 2.0, rel=5e-3)
    # Integral of 1 / (2 r): pi for every length; area is taken for two thirds of the projections,
    # which are 8 r where the area is 2 pi r. Differences over 25 densities are 1 % off.
    assert curvature == pytest.approx(np.pi * (8 / (3 * np.pi)) ** 2 / 2.0**2, rel=0.02)


def test_density_outside_the_window_takes_its_end():
    gyroid = calibrate(build_registry().cell_families["gyroid-sheet"])
    low, high = gyroid.window
    assert cell_surface(gyroid, 0.5 * low, 1.0) == cell_surface(gyroid, low, 1.0)
    assert cell_surface(gyroid, 1.0, 1.0) == cell_surface(gyroid, high, 1.0)
