"""Finite blocks under uniform boundary conditions, and conduction, against slow dense solves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gradedesign.errors import LatticeError, SolverError
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign_laboratory.block import filled_void, solve_block
from gradedesign_laboratory.conductivity import cell_conductivity, conductivity_bound

CORNERS = list(itertools.product((0, 1), repeat=3))
PAIRS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


def gauss():
    points = [0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5]
    for p in itertools.product(points, repeat=3):
        slope = np.zeros((3, 8))
        for a, corner in enumerate(CORNERS):
            for d in range(3):
                factors = [
                    (1.0 if corner[e] else -1.0) if e == d else (p[e] if corner[e] else 1 - p[e])
                    for e in range(3)
                ]
                slope[d, a] = np.prod(factors)
        yield slope


def strain_rows(slope):
    b = np.zeros((6, 24))
    for a in range(8):
        x, y, z = slope[:, a]
        b[:, 3 * a : 3 * a + 3] = [
            [x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0],
        ]  # fmt: skip
    return b


def dense(fill, nu):
    """Stiffness matrix of a block by loops, its nodes, and each voxel's node numbers."""
    c = solid_stiffness(nu)
    element = sum(strain_rows(s).T @ c @ strain_rows(s) / 8 for s in gauss())
    shape = tuple(n + 1 for n in fill.shape)
    k = np.zeros((3 * np.prod(shape),) * 2)
    members = []
    for voxel in np.ndindex(*fill.shape):
        nodes = [np.ravel_multi_index(tuple(np.add(voxel, corner)), shape) for corner in CORNERS]
        place = (3 * np.array(nodes)[:, None] + np.arange(3)).ravel()
        k[np.ix_(place, place)] += fill[voxel] * element
        members.append((fill[voxel], place))
    nodes = np.array(list(np.ndindex(*shape)), dtype=float)
    return k, nodes, members


def unit_strains():
    for i, j in PAIRS:
        strain = np.zeros((3, 3))
        strain[i, j] += 0.5
        strain[j, i] += 0.5
        yield strain


def mean_stress(fill, nu, members, u):
    c, total = solid_stiffness(nu), np.zeros(6)
    for value, place in members:
        for slope in gauss():
            total += value * c @ strain_rows(slope) @ u[place] / 8
    return total / fill.size


def slow_displacement(fill, nu):
    k, nodes, members = dense(fill, nu)
    edge = ((nodes == 0) | (nodes == np.array(fill.shape))).any(axis=1)
    inside = np.repeat(~edge, 3)
    columns = []
    for strain in unit_strains():
        u = (nodes @ strain).ravel()
        u[inside] = np.linalg.solve(
            k[np.ix_(inside, inside)], -k[np.ix_(inside, ~inside)] @ u[~inside]
        )
        columns.append(mean_stress(fill, nu, members, u))
    return np.array(columns).T


def slow_traction(fill, nu):
    k, _, members = dense(fill, nu)
    compliance = np.zeros((6, 6))
    forces = []
    for a in range(6):
        f = np.zeros(k.shape[0])
        for _, place in members:
            for slope in gauss():
                f[place] += strain_rows(slope).T @ np.eye(6)[a] / 8
        forces.append(f)
    for b in range(6):
        # Least norm: rigid motions change no strain.
        u = np.linalg.lstsq(k, forces[b], rcond=1e-12)[0]
        for a in range(6):
            compliance[a, b] = forces[a] @ u / fill.size
    return np.linalg.inv(compliance)


@pytest.fixture(scope="module")
def patchy():
    rng = np.random.default_rng(51)
    return rng.choice([1.0, 0.1, 0.4], size=(3, 4, 3))


def test_displacement_conditions_equal_a_dense_solve(patchy) -> None:
    found = solve_block(patchy, "displacement", rtol=1e-9)
    np.testing.assert_allclose(found.stiffness, slow_displacement(patchy, 0.3), atol=1e-9)


def test_traction_conditions_equal_a_dense_solve(patchy) -> None:
    found = solve_block(patchy, "traction", rtol=1e-9)
    np.testing.assert_allclose(found.stiffness, slow_traction(patchy, 0.3), atol=1e-9)


def test_energies_are_accurate_to_the_square(patchy) -> None:
    for condition in ("displacement", "traction"):
        rough = solve_block(patchy, condition, rtol=1e-3).stiffness
        exact = solve_block(patchy, condition, rtol=1e-9).stiffness
        assert np.abs(rough - exact).max() < 1e-5 * exact[0, 0]


@pytest.mark.parametrize("condition", ["displacement", "traction", "mixed"])
@pytest.mark.parametrize("nu", [0.3, 0.0])
def test_a_solid_block_is_its_material(condition, nu) -> None:
    found = solve_block(np.ones((3, 5, 4)), condition, poissons_ratio=nu, rtol=1e-10)
    np.testing.assert_allclose(found.stiffness, solid_stiffness(nu), atol=1e-9)


def test_tractions_on_void_are_refused() -> None:
    fill = np.ones((3, 3, 3))
    fill[0, 0, 0] = 0.0
    with pytest.raises(SolverError, match="some stiffness in every voxel"):
        solve_block(fill, "traction")
    assert solve_block(filled_void(fill), "traction").stiffness[0, 0] > 0.4


def test_an_empty_block_is_refused() -> None:
    with pytest.raises(SolverError, match="some solid"):
        solve_block(np.zeros((3, 3, 3)), "displacement")


def slow_conductivity(fill):
    """Assemble periodic conduction densely, loop by loop."""
    element = sum(s.T @ s / 8 for s in gauss())
    k = np.zeros((fill.size, fill.size))
    loads = np.zeros((fill.size, 3))
    for voxel in np.ndindex(*fill.shape):
        place = [
            np.ravel_multi_index(tuple(np.mod(np.add(voxel, c), fill.shape)), fill.shape)
            for c in CORNERS
        ]
        for (a, i), (b, j) in itertools.product(enumerate(place), repeat=2):
            k[i, j] += fill[voxel] * element[a, b]
        for a, i in enumerate(place):
            loads[i] += fill[voxel] * sum(s[:, a] / 8 for s in gauss())
    u = -np.linalg.lstsq(k, loads, rcond=1e-12)[0]
    return fill.mean() * np.eye(3) + loads.T @ u / fill.size


def test_conductivity_equals_a_dense_solve() -> None:
    fill = np.random.default_rng(52).choice([1.0, 0.2, 0.05], size=(4, 3, 5))
    found = cell_conductivity(fill, rtol=1e-9)
    np.testing.assert_allclose(found, slow_conductivity(fill), atol=1e-10)
    rough = cell_conductivity(fill, rtol=1e-4)
    np.testing.assert_allclose(rough, found, atol=1e-6)


def test_layers_conduct_in_parallel_and_in_series() -> None:
    values = np.array([1.0, 0.5, 0.1, 0.25])
    fill = np.broadcast_to(values[:, None, None], (4, 3, 3)).copy()
    found = cell_conductivity(fill, rtol=1e-10)
    parallel, series = values.mean(), 1 / np.mean(1 / values)
    np.testing.assert_allclose(found, np.diag([series, parallel, parallel]), atol=1e-10)


def test_a_plate_does_not_conduct_across() -> None:
    fill = np.zeros((8, 8, 8))
    fill[3:5] = 1.0
    with pytest.raises(LatticeError, match="three directions"):
        cell_conductivity(fill)


def test_conductivity_bound() -> None:
    # Hashin and Shtrikman 1962 with an insulator: 2 rho / (3 - rho); one for a solid.
    assert conductivity_bound(1.0) == 1.0
    assert conductivity_bound(0.3) == pytest.approx(0.6 / 2.7)
