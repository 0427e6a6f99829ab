"""A wall as a plate: Mindlin's plate, layers, ribs, and what has no stiffness at all."""

import numpy as np
import pytest

from gradedesign.errors import LatticeError, SolverError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.mechanics.homogenise.islands import connected_wall
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.wall import PLANE as IN_PLANE
from gradedesign.mechanics.homogenise.wall import wall_stiffness
from gradedesign.mechanics.homogenise.wall_ratios import _cut_fill
from gradedesign.program.host.registry import build_registry

NU = 0.3
PLANE = 1 / (1 - NU**2)
G = 1 / (2 * (1 + NU))
LAYERS = (1.0, 0.2, 0.2, 0.1, 0.6, 0.6)


def layered(voxels_per_layer):
    moduli = np.repeat(LAYERS, voxels_per_layer)
    fill = np.broadcast_to(moduli, (2, 2, moduli.size)).copy()
    return moduli, wall_stiffness(fill, rtol=1e-7)


def exact(moduli):
    """Membrane, bending and shear stiffness of layers, by integrals over the height.

    Classical laminate theory; shear by the flow that the growing moment asks for, whose energy is
    that of Reissner's stresses (for one layer: 5/6).
    """
    top = np.arange(1, moduli.size + 1) - 0.5 * moduli.size
    low = top - 1
    area = moduli.sum()
    neutral = (moduli * (top**2 - low**2) / 2).sum() / area
    bending = (moduli * ((top - neutral) ** 3 - (low - neutral) ** 3) / 3).sum()
    # Flow below a height inside a layer: a parabola, integrated exactly by three Gauss points.
    before = np.cumsum(moduli * ((top - neutral) ** 2 - (low - neutral) ** 2) / 2)
    before = before - moduli * ((top - neutral) ** 2 - (low - neutral) ** 2) / 2
    force = energy = 0.0
    for at, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
        z = low + 0.5 * (1 + at)
        flow = before + moduli * ((z - neutral) ** 2 - (low - neutral) ** 2) / 2
        force += 0.5 * weight * flow.sum()
        energy += 0.5 * weight * (flow**2 / (G * moduli)).sum()
    return area * PLANE, bending * PLANE, force**2 / energy


def test_a_homogeneous_wall_is_mindlins_plate():
    # Three heights: what the voxels miss falls with the square of their number.
    misses = []
    for n in (8, 16, 32):
        found = wall_stiffness(np.ones((3, 4, n)), rtol=1e-7)
        assert found.membrane[0, 0] == pytest.approx(PLANE * n, rel=1e-12)
        assert found.membrane[2, 2] == pytest.approx(G * n, rel=1e-12)
        assert found.bending[2, 2] == pytest.approx(G * n**3 / 12, rel=1e-9)
        assert found.bending[0, 1] == pytest.approx(NU * found.bending[0, 0], rel=1e-2)
        bent = found.bending[0, 0] / (PLANE * n**3 / 12) - 1
        sheared = found.shear / (5 / 6 * G * n) - 1
        misses.append([bent, *sheared])
    ratios = np.array(misses[:-1]) / misses[1:]
    np.testing.assert_allclose(ratios, 4.0, rtol=0.03)
    assert np.abs(misses[-1]).max() < 1e-3


def test_layers_follow_laminate_theory():
    found = []
    for n in (4, 8):
        moduli, wall = layered(n)
        membrane, bending, shear = exact(moduli)
        assert wall.membrane[0, 0] == pytest.approx(membrane, rel=1e-9)
        found.append([wall.bending[0, 0] / bending, *(wall.shear / shear)])
    # The rest is of second order in the voxel: extrapolated to nothing it is of fourth.
    coarse, fine = np.array(found)
    np.testing.assert_allclose(fine + (fine - coarse) / 3, 1.0, atol=2e-5)


def test_the_middle_plane_carries_no_force():
    # Void below the wall moves the middle of the grid, not the wall's stiffness.
    moduli, plain = layered(4)
    padded = np.zeros((2, 2, moduli.size + 6))
    padded[:, :, 6:] = moduli
    moved = wall_stiffness(padded, rtol=1e-7)
    np.testing.assert_allclose(moved.bending, plain.bending, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(moved.shear, plain.shear, rtol=1e-6)


def ribs():
    """A plate with ribs along x on one side."""
    fill = np.zeros((4, 12, 10))
    fill[:, :, :4] = 1.0
    fill[:, 4:8] = 1.0
    return fill


def test_turning_the_wall_turns_its_stiffness():
    along = wall_stiffness(ribs(), rtol=1e-6)
    across = wall_stiffness(ribs().swapaxes(0, 1).copy(), rtol=1e-6)
    swap = [1, 0, 2]
    size = np.abs(along.bending).max()
    np.testing.assert_allclose(across.membrane, along.membrane[swap][:, swap], atol=1e-5 * size)
    np.testing.assert_allclose(across.bending, along.bending[swap][:, swap], atol=1e-5 * size)
    np.testing.assert_allclose(across.shear, along.shear[::-1], rtol=1e-4)
    # Ribs carry along themselves: at least the sum over the sections, each with E instead of
    # E / (1 - nu^2), at most with the latter; a plate of 4 alone would have a twentieth.
    rib, plate = 4 * 10, 8 * 4
    neutral = (rib * 5 + plate * 2) / (rib + plate)
    inertia = 4 * 10**3 / 12 + rib * (5 - neutral) ** 2 + 8 * 4**3 / 12 + plate * (2 - neutral) ** 2
    assert inertia / 12 < along.bending[0, 0] < 1.01 * PLANE * inertia / 12
    assert along.bending[0, 0] > 3 * along.bending[1, 1]


def test_membrane_is_that_of_the_periodic_wall():
    # Two solvers of one quantity: mean stress there, mutual energies by Gauss points here.
    rng = np.random.default_rng(5)
    fill = np.clip(rng.uniform(-0.2, 1.0, (6, 6, 7)), 0, 1)
    apart = np.pad(fill, ((0, 0), (0, 0), (0, 1)))
    # Nearly nothing, so that the solid counts as connected across z too.
    apart[0, 0, -1] = 1e-7
    expected = 8 * solve_periodic(apart, rtol=1e-6).stiffness[np.ix_(IN_PLANE, IN_PLANE)]
    np.testing.assert_allclose(wall_stiffness(fill, rtol=1e-6).membrane, expected, atol=1e-6)


def test_strips_beside_each_other_are_no_wall():
    fill = np.zeros((6, 6, 6))
    fill[:, :3] = 1.0
    with pytest.raises(LatticeError, match=r"does not hang together: it resists no yy strain"):
        wall_stiffness(fill)


def test_a_single_layer_of_voxels_is_refused():
    with pytest.raises(SolverError, match=r"\(4, 4, 1\) voxels is too small"):
        wall_stiffness(np.ones((4, 4, 1)))


def thin_network(resolution):
    """A wall of 1.2 cells of a gyroid network at density 0.15."""
    cell = calibrate(build_registry().cell_families["gyroid-network"])
    return _cut_fill(cell, float(cell.level_of(0.15)), 2, 0.1, 1.3, resolution)


def test_a_thin_network_is_solved_in_transverse_shear():
    # Loads that keep a resultant of the earlier solves' residual let the iterations diverge. Shear
    # is right to the first power of a residual of 1e-3 in six states; 1e-7 leaves next to none.
    fill, middle = thin_network(16)
    found = wall_stiffness(fill, middle=middle, rtol=1e-3)
    exact = wall_stiffness(fill, middle=middle, rtol=1e-7)
    np.testing.assert_allclose(found.shear, exact.shear, rtol=1e-2)


def test_fragments_that_nothing_holds_are_left_out():
    fill = np.ones((6, 6, 8))
    fill[:, :, 5:] = 0.0
    fragment = fill.copy()
    fragment[2:4, 2:4, 6:] = 1.0
    np.testing.assert_array_equal(connected_wall(fragment), fill)


def test_a_wall_of_separate_bars_holds_nothing():
    fill = np.zeros((6, 6, 4))
    fill[:, 2:4, 1:3] = 1.0
    with pytest.raises(LatticeError, match=r"does not hang together: none .* both directions"):
        connected_wall(fill)
