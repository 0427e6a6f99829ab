"""Modes that reverse from cell to cell, critical stresses and their safe combination."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.periodic_buckling import periodic_buckling

from gradedesign.errors import DensityError, SolverError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.strength import LocalStress
from gradedesign.mechanics.material.buckling_law import BucklingLaw
from gradedesign.mechanics.material.buckling_table import BucklingTable
from gradedesign.mechanics.solver.eigen_solver import EigenProblem, ExtremeValue
from gradedesign_laboratory import critical_stress as critical_module
from gradedesign_laboratory.alternating import ALL_SIGNS, REPEATED, extended, folded
from gradedesign_laboratory.buckling import macro_prestress, weakest_modes
from gradedesign_laboratory.critical_stress import critical_stress, refined_mode
from gradedesign_laboratory.extreme_values import extreme_values
from gradedesign_laboratory.lanczos import LANCZOS
from gradedesign_laboratory.scipy_eigen import SCIPY


def frame(n: int, width: int) -> np.ndarray:
    """Square bars along the edges of a cube."""
    fill = np.zeros((n, n, n))
    fill[:width, :width] = fill[:width, :, :width] = fill[:, :width, :width] = 1.0
    return fill


def plate_load(thickness: int, wave: int, nu: float) -> float:
    """Critical compression over E of an endless plate, with shear and turning sections."""
    k = 2 * np.pi / wave
    bending, shear = thickness**3 / (12 * (1 - nu**2)), 5 / 6 / (2 * (1 + nu)) * thickness
    stiffness = np.array([[shear * k**2, -shear * k], [-shear * k, bending * k**2 + shear]])
    work = thickness * np.diag([k**2, thickness**2 * k**2 / 12])
    return float(scipy.linalg.eigh(stiffness, work, eigvals_only=True)[0])


def test_a_plate_of_half_a_wave_buckles_to_three_tenths_of_a_per_cent() -> None:
    # Reversed along x, so that half the wave fills the cell. Extrapolated from two and four voxels
    # across; what plates leave out is a tenth of a per cent at 24 thicknesses (measured for whole
    # waves by halving the thickness), the eigenvalue is right to 2e-4.
    def load(scale: int) -> float:
        fill = np.zeros((24 * scale, 2, 4 * scale))
        fill[:, :, : 2 * scale] = 1.0
        stress = np.zeros((6, *fill.shape))
        stress[0] = -fill
        start = np.random.default_rng(91).standard_normal((3, *fill.shape))
        found, _ = weakest_modes(
            fill, stress, poissons_ratio=0.3, start=start, signs=(-1, 1, 1), both=False
        )
        return 1 / found.value / plate_load(2 * scale, 48 * scale, 0.3)

    assert (4 * load(2) - load(1)) / 3 == pytest.approx(1.0, abs=0.003)


def test_eight_signs_on_one_cell_are_two_cells() -> None:
    # Slow version: the cell repeated eight times. Eigenvalues to 2e-4.
    solution = solve_periodic(frame(8, 2), rtol=1e-6)
    for macro in (np.array([0, 0, -1.0, 0, 0, 0]), np.array([0, 0.3, 0, 0.5, 0, 0])):
        slow = periodic_buckling(solution, macro, cells=2, rng=np.random.default_rng(92)).factor
        assert 1 / weakest(solution, macro) == pytest.approx(slow, rel=5e-4)


def weakest(solution, macro, combinations=ALL_SIGNS):
    """Largest inverse load factor over combinations of signs."""
    stress = macro_prestress(solution, macro)
    start = np.random.default_rng(93).standard_normal((3, *solution.fill.shape))
    return max(
        weakest_modes(
            solution.fill, stress, poissons_ratio=0.3, start=start, signs=signs, both=False
        )[0].value
        for signs in combinations
    )


SOLVERS = (LANCZOS, SCIPY)


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: s.name)
def test_both_ends_are_those_of_a_dense_matrix(solver) -> None:
    rng = np.random.default_rng(94)
    a, b = rng.standard_normal((2, 40, 40))
    form, k = a + a.T, b @ b.T + 40 * np.eye(40)
    expected = scipy.linalg.eigh(form, k, eigvals_only=True)
    inverse = np.linalg.inv(k)
    high, low = extreme_values(
        solver,
        EigenProblem(
            form=lambda x: form @ x,
            stiffness=lambda x: k @ x,
            solve=lambda x: inverse @ x,
            start=rng.standard_normal(40),
            both=True,
            negligible=0,
        ),
    )
    assert high.value == pytest.approx(expected[-1], rel=1e-4)
    assert low is not None
    assert low.value == pytest.approx(expected[0], rel=1e-4)


def test_folding_is_the_transpose_of_extending() -> None:
    rng = np.random.default_rng(95)
    for signs in ALL_SIGNS:
        u = rng.standard_normal((3, 4, 5, 6))
        ahead = extended(u, signs)
        force = rng.standard_normal(ahead.shape)
        assert np.vdot(force, ahead) == pytest.approx(np.vdot(folded(force, signs), u))


def test_a_refined_mode_is_linear_between_nodes_and_reverses() -> None:
    n = 6
    mode = np.zeros((3, n, 4, 4))
    mode[2] = np.cos(np.pi * np.arange(n) / n)[:, None, None]
    fine = refined_mode(mode, (-1, 1, 1))
    along = fine[2, :, 3, 5]
    np.testing.assert_allclose(along[::2], mode[2, :, 0, 0])
    assert along[-1] == pytest.approx(0.5 * (mode[2, -1, 0, 0] - mode[2, 0, 0, 0]))


@pytest.fixture(scope="module")
def frame_and_law():
    """A small frame, and the law of its modes that repeat after one cell on that very grid."""
    solution = solve_periodic(frame(8, 2), rtol=1e-6)
    sizes = np.zeros((6, 2))
    for load, sense in ((0, 0), (0, 1), (5, 0)):
        macro = (-1.0 if sense == 0 else 1.0) * np.eye(6)[load]
        sizes[load, sense] = 1 / weakest(solution, macro, [REPEATED])
    sizes[5, 1] = sizes[5, 0]
    sizes[1:3], sizes[3:5] = sizes[0], sizes[5]
    return solution, BucklingLaw(table=table_of(sizes))


def table_of(sizes, density=(0.1, 0.3), exponent=2.0):
    """A table of power laws that has ``sizes`` at the first density."""
    scale = (np.asarray(density) / density[0]) ** exponent
    count = len(density)
    return BucklingTable(
        density=np.asarray(density),
        critical=scale[:, None, None] * sizes,
        cells=np.ones((count, 6, 2), dtype=np.int64),
        error=np.zeros(count),
        resolution=np.full(count, 8),
        wall_voxels=np.full(count, 3.0),
        poissons_ratio=0.3,
        method="test",
        version="test",
        date="2026-11-21",
    )


@settings(max_examples=12, deadline=None, derandomize=True)
@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6).filter(lambda v: max(map(abs, v)) > 0.1))
def test_the_sum_of_uses_is_safe(frame_and_law, values) -> None:
    # Convexity: use one, summed over components, never lies beyond the true load of the grid.
    solution, law = frame_and_law
    macro = np.array(values)
    use = float(law.profile(macro[:, None])[0, 0])
    assert use >= weakest(solution, macro, [REPEATED]) * (1 - 1e-3)


def boxes(u: np.ndarray) -> np.ndarray:
    """Distance from the faces of the cell: closed boxes of plates."""
    u = np.asarray(u)
    return np.min(np.abs(u - np.round(u)), axis=0)


FAMILY = CellFamily(
    name="test-boxes", shape=boxes, symmetry="cubic", distance=True, open_void=False
)


@pytest.mark.slow
def test_critical_stresses_of_boxes() -> None:
    # Square plates along the load, k pi^2 / (12 (1 - nu^2)) (t / b)^2 with k 4 where all edges are
    # hinged and 10.07 where all are clamped (Timoshenko and Gere, Theory of elastic stability,
    # 9.2 and 9.4); two of the three families of plates carry.
    row = critical_stress(calibrate(FAMILY), 0.3, resolution=28)
    wall = 1 - 0.7 ** (1 / 3)
    plate = np.pi**2 / 12 / (1 - 0.3**2) * wall**2
    assert 4 < row.critical[0, 0] / (2 * wall * plate) < 10.07
    assert row.critical[0, 0] < row.critical[0, 1]
    assert row.error < 0.15
    # Neighbouring plates bulge to opposite sides.
    assert row.cells[0, 0] == 2
    np.testing.assert_array_equal(row.critical[1], row.critical[0])
    np.testing.assert_array_equal(row.critical[5, 0], row.critical[5, 1])


def test_a_wall_of_two_voxels_is_refused() -> None:
    with pytest.raises(DensityError, match="voxels across"):
        critical_stress(calibrate(FAMILY), 0.2, resolution=16)


@pytest.mark.parametrize(("amplification", "settles"), [(40.0, True), (20.0, False)])
def test_a_load_that_does_not_settle_counts_only_as_what_yields_before(
    monkeypatch, amplification, settles
) -> None:
    # Origin: at 0.05 E of local stress, 40 times the macroscopic one, the cell bears 0.00125 E; the
    # fine grid buckles at 0.003 E, from 0.006 E on the coarse one. At 20 times 0.0025 E is too
    # near.
    solution = SimpleNamespace(fill=np.ones((4, 4, 4)), poissons_ratio=0.3)
    local = LocalStress(stress=amplification * np.eye(6)[..., None], volume=np.ones(1))
    monkeypatch.setattr(critical_module, "local_stress", lambda _: local)
    monkeypatch.setattr(critical_module, "macro_prestress", lambda *_: np.zeros((6, 4, 4, 4)))
    fine = ExtremeValue(value=1 / 0.003, vector=np.zeros(192))
    monkeypatch.setattr(critical_module, "weakest_modes", lambda *_, **__: (fine, None))
    coarse = {(1, 1, 1): ExtremeValue(value=1 / 0.006, vector=np.zeros(24))}
    if settles:
        found = critical_module._refined(solution, 0, 0, coarse, LANCZOS)
        assert found == (pytest.approx(0.00125), 0, 0.0)
    else:
        with pytest.raises(SolverError, match="too much to extrapolate"):
            critical_module._refined(solution, 0, 0, coarse, LANCZOS)
