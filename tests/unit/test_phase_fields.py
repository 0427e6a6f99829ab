"""Phase fields: the solver against scikit-fem, the splines, and what a graded map keeps."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, ElementHex1, LinearForm, MeshHex
from skfem.helpers import dot, grad

from gradedesign.errors import CaseError, DensityError, ResourceError
from gradedesign.geometry.maps import phase_fields, size_law
from gradedesign.geometry.maps._phase_kernels import (
    centre_gradients,
    divergence,
    nearest_rotations,
)
from gradedesign.geometry.maps.cell_map import uniform_map
from gradedesign.geometry.maps.map_report import volume_points
from gradedesign.geometry.maps.phase_fields import box_solver, default_spacing, graded_size_map

COUNT, STEPS = (5, 4, 3), np.array([2.0, 3.0, 1.5])
NODES = tuple(n + 1 for n in COUNT)


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def reference(target):
    """Stiffness and loads by scikit-fem on the same grid, nodes in our order."""
    mesh = MeshHex.init_tensor(*[h * np.arange(n + 1) for h, n in zip(STEPS, COUNT, strict=True)])
    basis = Basis(mesh, ElementHex1())
    index = np.floor(mesh.p[:, mesh.t].mean(axis=1) / STEPS[:, None]).astype(int)
    at_points = np.ones((1, basis.X.shape[1]))
    stiffness = BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    loads = []
    for row in range(3):
        g = np.moveaxis(target[tuple(index)][:, row], 0, 1)[:, :, None] * at_points
        loads.append(LinearForm(lambda v, e: dot(e.g, grad(v))).assemble(basis, g=g))
    node = np.round(mesh.p / STEPS[:, None]).astype(int)
    order = np.ravel_multi_index(tuple(node), NODES)
    place = np.argsort(order)
    return stiffness.tocsr()[place][:, place], np.array(loads)[:, place]


def random_target(seed):
    return np.random.default_rng(seed).normal(size=(*COUNT, 3, 3))


def test_loads_agree_with_scikit_fem():
    target = random_target(20264)
    _, loads = reference(target)
    np.testing.assert_allclose(divergence(target, STEPS).reshape(3, -1), loads, atol=1e-12)


def test_box_solver_agrees_with_a_sparse_solve():
    stiffness, loads = reference(random_target(20266))
    solve = box_solver(NODES, STEPS)
    exact = np.append(0.0, spsolve(stiffness[1:, 1:].tocsc(), loads[0][1:]))
    mine = solve(loads[0].reshape(NODES)).ravel()
    np.testing.assert_allclose(mine - mine[0], exact, atol=1e-11)


def test_centre_gradients_of_a_linear_field_are_exact():
    matrix = np.random.default_rng(20268).normal(size=(3, 3))
    nodes = np.stack(np.meshgrid(*[np.arange(n) * h for n, h in zip(NODES, STEPS, strict=True)],
                                 indexing="ij"))  # fmt: skip
    phases = np.tensordot(matrix, nodes, axes=1)
    found = centre_gradients(phases, STEPS)
    np.testing.assert_allclose(found, np.broadcast_to(matrix, found.shape), atol=1e-13)


def test_nearest_rotations_agree_with_the_polar_decomposition():
    rng = np.random.default_rng(20269)
    matrix = turned(0.7) + rng.normal(scale=0.15, size=(300, 3, 3))
    left, _, right = np.linalg.svd(matrix)
    start = np.tile(np.eye(3), (300, 1, 1))
    np.testing.assert_allclose(nearest_rotations(matrix, start), left @ right, atol=1e-7)


def test_nearest_rotations_of_folded_matrices_are_rotations():
    matrix = np.diag([1.0, 0.9, -0.4]) + np.random.default_rng(20270).normal(
        scale=0.05, size=(50, 3, 3)
    )
    found = nearest_rotations(matrix, np.tile(np.eye(3), (50, 1, 1)))
    np.testing.assert_allclose(np.linalg.det(found), 1.0, atol=1e-9)
    np.testing.assert_allclose(
        found @ found.transpose(0, 2, 1), np.tile(np.eye(3), (50, 1, 1)), atol=1e-9
    )


def test_one_size_gives_the_uniform_map_inside_and_beyond_the_box():
    lower, upper = np.array([1.0, -2.0, 3.0]), np.array([31.0, 18.0, 20.0])
    graded = graded_size_map(lambda p: 0 * p[0] + 8.0, lower, upper, spacing=3.0)
    points = np.random.default_rng(20271).uniform(-20.0, 50.0, (3, 200))
    np.testing.assert_allclose(graded(points), uniform_map(8.0, origin=lower)(points), atol=1e-9)
    np.testing.assert_allclose(
        graded.jacobian(points), uniform_map(8.0).jacobian(points), atol=1e-10
    )
    assert graded.size == 8.0


def size_of(points):
    return 9.0 + 0.05 * points[0] + 1.5 * np.sin(points[1] / 15.0) + 0.03 * points[2]


BOX = (np.zeros(3), np.array([60.0, 40.0, 30.0]))


def test_derivative_agrees_with_differences_and_is_continuous_at_the_border():
    graded = graded_size_map(size_of, *BOX, spacing=3.0)
    points = np.random.default_rng(20272).uniform(-5.0, 50.0, (3, 300))
    h = 1e-4
    slope = graded.jacobian(points)
    for axis, shift in enumerate(h * np.eye(3)):
        move = shift[:, None]
        difference = (graded(points + move) - graded(points - move)) / (2 * h)
        np.testing.assert_allclose(slope[:, axis], difference, atol=1e-7)
    edge = np.array([[60.0 - 1e-7, 60.0 + 1e-7], [20.0, 20.0], [10.0, 10.0]])
    step = np.diff(graded.jacobian(edge), axis=-1)
    assert np.abs(step).max() < 1e-8
    grown = graded(points.reshape(3, 3, 4, 25))
    np.testing.assert_array_equal(grown.reshape(3, -1), graded(points))


def test_a_corner_of_a_cell_lies_at_the_origin():
    graded = graded_size_map(size_of, *BOX, spacing=3.0, origin=(20.0, 10.0, 15.0))
    np.testing.assert_allclose(graded(np.array([20.0, 10.0, 15.0])), 0.0, atol=1e-12)


def energy(cell_map):
    """Mean of |grad(u) - R / L|^2 at its best rotation, over the box."""
    points = volume_points(None, *BOX, 20_000)
    matrix = np.moveaxis(cell_map.jacobian(points) * size_of(points), -1, 0)
    left, _, right = np.linalg.svd(matrix)
    return float((((matrix - left @ right) ** 2).sum(axis=(1, 2)) / size_of(points) ** 2).mean())


def test_rotations_lower_the_energy(monkeypatch):
    # Weighing size against angles afterwards has another aim.
    monkeypatch.setattr(size_law, "NEAR_SHARE", 2.0)
    found = [energy(graded_size_map(size_of, *BOX, spacing=3.0, iterations=n)) for n in (0, 1, 4)]
    assert found[1] < 0.9 * found[0]
    assert found[2] < 0.9 * found[1]


def test_frames_turn_the_cells():
    turn = turned(0.4)

    def frame_of(points):
        return np.broadcast_to(turn[:, :, None, None, None], (3, 3, *points.shape[1:]))

    graded = graded_size_map(
        lambda p: 0 * p[0] + 8.0, *BOX, spacing=4.0, frame_of=frame_of, iterations=0
    )
    points = np.random.default_rng(20273).uniform(0.0, 30.0, (3, 50))
    np.testing.assert_allclose(graded(points), turn @ points / 8.0, atol=1e-9)


def test_half_a_million_nodes_or_a_quarter_of_a_cell():
    assert default_spacing((0, 0, 0), (100, 100, 100), 20.0) == pytest.approx(5.0)
    assert default_spacing((0, 0, 0), (1000, 1000, 1000), 40.0) == pytest.approx(12.599, abs=1e-3)
    assert default_spacing((0, 0, 0), (1000, 1000, 1000), 12.0) == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("changes", "kind", "words"),
    [
        ({"upper": (0, 40, 30)}, CaseError, "box of the cell map"),
        ({"upper": (np.nan, 40, 30)}, CaseError, "box of the cell map"),
        ({"spacing": 0.0}, CaseError, "grid step"),
        ({"spacing": 6.0}, CaseError, "too coarse for cells of"),
        ({"size_of": lambda p: p[0] - 10.0}, DensityError, "not positive at"),
        ({"size_of": lambda p: p[0] * np.inf}, DensityError, "not positive at"),
        ({"size_of": lambda p: np.ones(p.shape)}, DensityError, "returned shape"),
        ({"iterations": -1}, CaseError, "iterations"),
    ],
)
def test_impossible_gradings_are_refused(changes, kind, words):
    asked = {"size_of": size_of, "lower": BOX[0], "upper": BOX[1], "spacing": 3.0} | changes
    with pytest.raises(kind, match=words):
        graded_size_map(**asked)


def test_a_grid_too_large_is_refused_with_the_step_that_fits(monkeypatch):
    monkeypatch.setattr(phase_fields, "MOST_NODES", 1000)
    with pytest.raises(ResourceError, match="use a step of at least"):
        graded_size_map(size_of, *BOX, spacing=1.0)
