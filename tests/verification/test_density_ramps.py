"""A linear density over ten cells: every slab of one cell, and the whole, have what was asked for.

The ramp runs across the family's window, at most 0.1 to 0.5. Volumes are those of the lattice's
field, by evenly spread points, and of the surface that would be printed.
"""

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.printed_surface import MOST_STEPS_PER_CELL, STEPS_PER_WALL
from gradedesign.geometry.lattice.slab_density import slab_density, total
from gradedesign.geometry.lattice.trim import trimmed_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.program.host.registry import build_registry

REGISTRY = build_registry()
CELLS, SIZE = 10, 10.0
FEW = ("gyroid-network", "diamond-sheet", "bcc")


@pytest.fixture(scope="module")
def families():
    return REGISTRY.cell_families


def ramp(calibration, cells=CELLS):
    """A bar of one period across and ``cells`` periods long, and its box."""
    period = SIZE * calibration.family.period
    edges = np.array([cells * period, period, period])
    low, high = max(0.1, calibration.window[0]), min(0.5, calibration.window[1])
    nodes = np.arange(-1, cells + 2) / cells
    values = np.clip(low + (high - low) * nodes, calibration.window[0], calibration.window[1])
    half = (edges / 2)[:, None]

    def part(p):
        flat = p.reshape(3, -1)
        return (np.abs(flat - half) - half).max(axis=0).reshape(p.shape[1:])

    design = LatticeDesign(
        domain=DesignDomain(distance=part, lower=[0, 0, 0], upper=edges),
        cells=single(calibration),
        cell_map=lambda p: p / SIZE,
        cell_size=SIZE,
        density=DensityGrid(
            origin=[-period, -period, -period],
            spacing=period,
            values=np.broadcast_to(values[:, None, None], (len(values), 4, 4)),
        ),
    )
    return design, box_surface(tuple(edges)), period


def require_ramp(calibration, steps=32):
    design, part, period = ramp(calibration)
    # A bar of random cells takes a hundred million nodes, and its surface is contoured as any.
    periodic = calibration.family.period == 1
    surface = trimmed_surface(design, part, period / steps) if periodic else part
    slabs = slab_density(design, lattice_field(design), surface, part, axis=0, thickness=period)
    for what in ("field", "surface") if periodic else ("field",):
        error = np.abs(getattr(slabs, what) - slabs.target)
        assert error.max() <= 0.01, (what, error)
        assert abs(total(slabs, what) - total(slabs, "target")) <= 0.003, what


@pytest.mark.parametrize("name", FEW)
def test_few_families(families, name):
    require_ramp(calibrate(families[name]))


def test_a_level_linear_in_place_would_fail(families):
    # What Raymont accepts (section 4.1): the level, not the density, linear along the ramp. The
    # volume of struts grows with the square of the radius: half way it is 0.262, not 0.3, if they
    # did not overlap where they meet.
    calibration = calibrate(families["bcc"])
    ends = [float(calibration.level_of(rho)) for rho in (0.1, 0.5)]
    middle = float(calibration.density_of(np.mean(ends)))
    assert 0.262 < middle < 0.285


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(REGISTRY.cell_families))
def test_every_installed_family(families, name):
    # Thin walls and small voids need a finer grid: as a run of a stated density has it for walls,
    # also where bodies hardly touch and there is none (0 mm).
    calibration = calibrate(families[name])
    low = max(0.1, calibration.window[0])
    wall = float(wall_mm(calibrate(families[name], calibration.parameters), low, SIZE))
    spacing = max(min(SIZE / 48, wall / STEPS_PER_WALL), SIZE / MOST_STEPS_PER_CELL)
    require_ramp(calibration, steps=int(np.ceil(SIZE / spacing)))
