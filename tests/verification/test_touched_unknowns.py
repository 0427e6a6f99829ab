"""Predicted unknowns of finite cells against the bricks that lattices really touch."""

import numpy as np
import pytest
from finite_cell_solids import box_face, load_case, newtons, problem

from gradedesign.design.resolve.planned_solid import PlannedPart, planned_solid
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell_surface import cell_surface
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.mechanics.explicit.analysis import PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.finite_cell.analysis import divide
from gradedesign.mechanics.finite_cell.space import unknown_count
from gradedesign.program.host.registry import build_registry

CELLS = (3.0, 2.0, 2.0)
#: The formula is exact for grids in random places; what 12 cells leave of chance was measured on
#: 36 combinations of cell, density and spacing: 0.75 to 1.21 where bricks are smaller than
#: a quarter of a cell, thick struts of bcc worst; those below lie within this.
SPREAD = 0.15


@pytest.mark.parametrize(
    ("name", "rho", "bricks_per_wall"),
    [
        ("gyroid-sheet", 0.15, 0.4),
        ("gyroid-sheet", 0.3, 0.71),
        ("primitive-sheet", 0.3, 0.42),
        ("octet", 0.15, 1.8),
        ("bcc", 0.15, 1.8),
        ("gyroid-network", 0.2, 1.8),
    ],
)
def test_predicted_unknowns_are_those_of_the_bricks_that_hold_solid(name, rho, bricks_per_wall):
    cell = calibrate(build_registry().cell_families[name])
    level, spacing = float(cell.level_of(rho)), float(wall_mm(cell, rho, 1.0)) / bricks_per_wall
    regions = {f"x{side}": box_face(f"x{side}", (0, 0, 0), CELLS, 0, side) for side in range(2)}
    press = load_case("press", [("x0", "xyz")], [("x1", {"force": newtons(-1, 0, 0)})])
    elements, space = divide(
        problem(
            lambda p: cell.family.shape(p, **cell.parameters) - level,
            (0.0, 0.0, 0.0), CELLS, [press], regions,
        ),
        spacing,
    )  # fmt: skip
    part = PlannedPart(
        box=CELLS, latticed=float(np.prod(CELLS)), solid=0.0, inclined=0.0, inner=0.0, load_cases=1
    )
    planned = planned_solid(part, rho, cell_surface(cell, rho, 1.0))
    predicted = FINITE_CELLS.estimate(planned, float(elements.grid.edges.max())).unknowns
    assert predicted == pytest.approx(unknown_count(space), rel=SPREAD)


def test_skins_and_inclined_faces_cut_elements_and_a_full_box_does_not():
    def unknowns(**others):
        stated = {"latticed": 0.0, "solid": 1000.0, "inclined": 0.0, "inner": 0.0} | others
        part = PlannedPart(box=(10.0, 10.0, 10.0), load_cases=1, **stated)
        nothing = cell_surface(calibrate(build_registry().cell_families["bcc"]), 0.3, 1e9)
        return FINITE_CELLS.estimate(planned_solid(part, 0.3, nothing), 0.5).unknowns

    assert unknowns() == 24 * 20**3
    assert unknowns(inclined=100.0) - unknowns() == pytest.approx(18 * 100 / 0.25)
    # Never more than the whole grid of the box has.
    assert unknowns(inner=1e6) == 3 * 41**3


def test_ball_touches_the_nodes_that_steiners_formula_counts():
    """The formula is exact in the mean over places of the grid; 40 places leave 1 % of chance."""
    radius, spacing = 2.0, 0.9
    ball = PlannedSolid(
        box=(40.0, 40.0, 40.0), volume=4 / 3 * np.pi * radius**3, load_cases=1,
        projections=6 * np.pi * radius**2, curvature=4 * np.pi * radius,
    )  # fmt: skip
    # Bricks whose nearest point to the centre is within the radius, and their nodes.
    index = np.stack(np.meshgrid(*[np.arange(-6, 7)] * 3, indexing="ij")).reshape(3, -1)
    counts = []
    for centre in np.random.default_rng(7).random((40, 3)):
        near = np.clip(centre[:, None], index, index + 1) - centre[:, None]
        touched = index[:, spacing * np.linalg.norm(near, axis=0) < radius]
        offsets = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij")).reshape(3, -1)
        nodes = (2 * touched[:, :, None] + offsets[:, None]).reshape(3, -1)
        counts.append(3 * len(np.unique(nodes, axis=1).T))
    # What the formula leaves out is the volume of the grown box itself: 1, 2, 4 and 8 bricks for
    # the kinds of nodes, 27 together, three unknowns each.
    expected = FINITE_CELLS.estimate(ball, spacing).unknowns + 3 * 27
    assert np.mean(counts) == pytest.approx(expected, rel=0.01)
