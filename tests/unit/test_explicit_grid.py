"""Elements across the thinnest wall: a cell of struts needs more than one of walls."""

import numpy as np
import pytest

from gradedesign.design.resolve.registry import lookup
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.mechanics.explicit.grid_resolution import (
    PER_SHEET,
    PER_STRUT,
    curvature_over_width,
    elements_per_wall,
)
from gradedesign.program.host.registry import build_registry


def round_struts(u):
    """Distance to struts along x, y and z through the middle of the cell."""
    away = np.abs(u - np.floor(u) - 0.5)
    x, y, z = away
    return np.minimum(np.minimum(np.hypot(x, y), np.hypot(y, z)), np.hypot(z, x))


STRUTS = CellFamily(name="round-struts", shape=round_struts, distance=True)


def cell(name):
    return calibrate(lookup(build_registry(), "cell_families", name))


@pytest.mark.parametrize(
    "name", ["primitive-sheet", "gyroid-sheet", "diamond-wall", "cube-pores", "honeycomb-plates"]
)
def test_walls_need_the_fewest(name):
    assert elements_per_wall(cell(name)) == PER_SHEET


@pytest.mark.parametrize("name", ["octet", "bcc-triangle", "gyroid-network", "kelvin", "delaunay"])
def test_struts_need_more(name):
    assert elements_per_wall(cell(name)) == PER_STRUT


def test_round_struts_have_the_curvature_of_their_length_and_joints():
    """Three struts that cross at right angles, against the volume of three crossing cylinders."""
    thin, rho = calibrate(STRUTS), 0.05
    r = float(thin.level_of(rho))
    # Of volume 3 pi r^2 - 8 sqrt(2) r^3 (Steinmetz); its derivatives by r are area and twice the
    # integral of mean curvature. Projections of surfaces about an axis add up to 4 / pi of their
    # area, where evenly spread normals have 3 / 2.
    spread = (4 / np.pi) / 1.5
    along = 6 * np.pi - 48 * np.sqrt(2) * r
    exact = spread * along / (6 * np.pi - 24 * np.sqrt(2) * r)
    assert curvature_over_width(thin, rho) == pytest.approx(exact, rel=0.03)
