"""Recovery of a stiffness from virtual tests against every printed entry, and tets of images.

Printed values: A. P. Raymont, thesis, Exeter 2011, chapter 7, to the digits printed there.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign_laboratory.block import solve_block
from gradedesign_laboratory.macro_element import (
    recover_stiffness,
    recovery_matrix,
    strain_matrix,
    unit_strain_tests,
)
from gradedesign_laboratory.macro_tet import crop_to_tet, face_distance, macro_tet

#: E = 1, nu = 0.25.
PLANE_STRESS = np.array([[16.0, 4.0, 0], [4.0, 16.0, 0], [0, 0, 6.0]]) / 15
# Eq. 7.14 with the second and third corner in the order of eq. 7.15.
TRIANGLE = np.array([[7.0, 36.0, 26.0], [4.0, 10.0, 19.0]])
# Eq. 7.17.
K_PRINTED = """
.1969 .0935 -.1059 -.0224 -.0910 -.0710
.0935 .2166 .0442 .2316 -.1377 -.4482
-.1059 .0442 .5987 -.2959 -.4928 .2517
-.0224 .2316 -.2959 .7400 .3184 -.9715
-.0910 -.1377 -.4928 .3184 .5838 -.1807
-.0710 -.4482 .2517 -.9715 -.1807 1.4197
"""
# Table 7.2, of the triangle (0,0), (-2,-2), (1,-4).
TABLE_72 = """
.20 0 .60 0 0 .45
0 .30 .20 0 .45 .30
-.40 0 -.70 0 0 -.15
0 -.10 -.40 0 -.15 -.60
.20 0 .10 0 0 -.30
0 -.20 .20 0 -.30 .30
0 .30 .20 0 .45 .30
0 0 0 .45 .60 .20
0 -.60 -.40 0 -.15 -.10
0 0 0 -.15 -.70 -.40
0 .30 .20 0 -.30 -.20
0 0 0 -.30 .10 .20
"""
# Table 7.4, with f2[4] and f3[1] of the sign and value that balance and symmetry demand.
TABLE_74 = """
.327 .107 -.082 -.188 -.245 .081
.107 .786 -.121 .043 .014 -.829
-.082 -.121 .346 -.036 -.264 .157
"""
# Table 7.5, with f3[1] negative as symmetry demands.
TABLE_75 = """
-.12 -1.18 -.27 -.04 1.08 2.47
1.08 -5.02 -1.64 .59 5.28 7.38
2.47 -7.80 -2.11 1.04 7.38 11.23
-1.18 5.13 1.48 -.5 -5.02 -7.8
-1.33 5.97 1.82 -.94 -6.14 -8.92
-2.24 8.01 2.27 -1.06 -7.77 -11.66
-.27 1.48 .57 -.04 -1.64 -2.11
.29 -.46 -.14 -.32 .27 .5
-.48 1.71 .46 -.17 -1.58 -2.59
1.57 -5.43 -1.78 .57 5.58 7.45
-.04 -.5 -.04 .68 .59 1.04
.25 -1.91 -.62 .18 1.98 3.03
"""
TET = np.array([[0.0, 0, 0], [-0.9, -0.5, -0.7], [0, -0.6, 2.0], [-0.6, 0.3, 1.0]]).T
#: Printed order xx, yy, zz, xy, yz, zx in ours.
ORDER = [0, 1, 2, 4, 5, 3]
#: x1, x2, x3, y4, y1, z1.
TESTS = np.eye(12)[:, [0, 3, 6, 10, 1, 2]]


def table(text: str) -> np.ndarray:
    return np.array([[float(v) for v in line.split()] for line in text.strip().splitlines()])


def printed_stiffness() -> np.ndarray:
    d = np.zeros((6, 6))
    d[np.triu_indices(6)] = np.arange(1.0, 22.0)
    d = d + np.triu(d, 1).T
    return d[np.ix_(ORDER, ORDER)]


def test_triangle_of_the_worked_example() -> None:
    b, area = strain_matrix(TRIANGLE)
    assert area == pytest.approx(160.5)
    printed = [[-0.028, 0, 0.047, 0, -0.019, 0], [0, -0.031, 0, -0.059, 0, 0.090]]
    np.testing.assert_allclose(b[:2], printed, atol=5.1e-4)
    np.testing.assert_allclose(b[2], [-0.031, -0.028, -0.059, 0.047, 0.090, -0.019], atol=5.1e-4)
    k = area * b.T @ PLANE_STRESS @ b
    # Some entries are cut, not rounded: one unit of the last digit.
    np.testing.assert_allclose(k, table(K_PRINTED), rtol=0, atol=1e-4)


def test_recovery_in_the_plane_from_the_printed_forces() -> None:
    # Three corners moved one at a time; eq. 7.19 prints these rows of the coefficients.
    tests = np.eye(6)[:, :3]
    m = recovery_matrix(TRIANGLE, tests)
    assert m.shape == (18, 6)
    np.testing.assert_allclose(m[0], [0.1262, 0, 0.2804, 0, 0, 0.1558], atol=6e-5)
    np.testing.assert_allclose(m[1], [0, 0.1402, 0.1262, 0, 0.1558, 0.1402], atol=6e-5)
    assert np.linalg.matrix_rank(m) == 6
    forces = table(K_PRINTED)[:, :3]
    np.testing.assert_allclose(recover_stiffness(TRIANGLE, tests, forces), PLANE_STRESS, atol=5e-4)


def test_coefficients_of_two_tests_have_rank_five() -> None:
    triangle = np.array([[0.0, -2.0, 1.0], [0.0, -2.0, -4.0]])
    m = recovery_matrix(triangle, np.eye(6)[:, :2])
    np.testing.assert_allclose(m, table(TABLE_72), atol=1e-9)
    assert np.linalg.matrix_rank(m) == 5
    assert np.linalg.matrix_rank(recovery_matrix(triangle, np.eye(6)[:, :3])) == 6
    with pytest.raises(SolverError, match="span 2 of 3"):
        recover_stiffness(triangle, np.eye(6)[:, :2], np.ones((6, 2)))


def test_macro_triangle_of_sixteen() -> None:
    # Its corners are not printed; these, up to scale, are what the forces fit. Three digits.
    triangle = np.array([[0.0, 0.9286, 0.0931], [0.0, 0.3711, 0.5568]])
    found = recover_stiffness(triangle, np.eye(6)[:, :3], table(TABLE_74).T)
    np.testing.assert_allclose(found, PLANE_STRESS, atol=0.004)


def test_recovery_in_space() -> None:
    b, volume = strain_matrix(TET)
    assert volume == pytest.approx(0.322)
    assert b.shape == (6, 12)
    forces = volume * b.T @ printed_stiffness() @ b @ TESTS
    np.testing.assert_allclose(forces, table(TABLE_75), atol=0.0056)
    m = recovery_matrix(TET, TESTS)
    assert m.shape == (72, 21)
    assert np.linalg.matrix_rank(m) == 21
    np.testing.assert_allclose(
        recover_stiffness(TET, TESTS, forces), printed_stiffness(), atol=1e-9
    )


def test_which_tests_determine_the_stiffness() -> None:
    # Number of single displacements along x, y, z: 2/2/2 mostly works, 4/1/1 never; five never do.
    forces = np.zeros((12, 6))
    recover_stiffness(TET, np.eye(12)[:, [0, 3, 1, 7, 2, 11]], forces)
    for chosen in ([0, 3, 6, 9, 1, 2], [0, 3, 6, 1, 4]):
        with pytest.raises(SolverError, match="use unit_strain_tests"):
            recover_stiffness(TET, np.eye(12)[:, chosen], forces[:, : len(chosen)])
    unit = np.linalg.cond(recovery_matrix(TET, unit_strain_tests(TET)))
    assert unit < 0.2 * np.linalg.cond(recovery_matrix(TET, TESTS))


def test_unit_strain_tests_strain_one_component_each() -> None:
    for corners, n in ((TET, 6), (TRIANGLE, 3)):
        b, _ = strain_matrix(corners)
        np.testing.assert_allclose(b @ unit_strain_tests(corners), np.eye(n), atol=1e-12)


def test_a_flat_element_is_refused() -> None:
    with pytest.raises(SolverError, match="flat"):
        strain_matrix(np.array([[0.0, 1, 2, 0], [0, 1, 2, 1], [0, 0, 0, 0]]))


def inscribed(n: int) -> np.ndarray:
    """Largest tetrahedron in a cube: a third of it."""
    return n * np.array([[0.0, 1, 1, 0], [0, 1, 0, 1], [0, 0, 1, 1]])


def test_distance_to_the_faces_of_a_tet() -> None:
    corners = inscribed(10)
    assert face_distance(corners, np.full(3, 5.0)) == pytest.approx(10 / (2 * 3**0.5))
    np.testing.assert_allclose(face_distance(corners, corners), 0.0, atol=1e-12)
    assert face_distance(corners, np.array([0.0, 0.0, 10.0])) < 0


def test_a_crop_keeps_the_volume_and_no_void_is_filled() -> None:
    n = 40
    full = crop_to_tet(np.ones((n, n, n)), inscribed(n))
    # Raymont 7.3.5 asks for 1 %.
    assert full.sum() == pytest.approx(n**3 / 3, rel=0.01)
    hollow = np.ones((n, n, n))
    hollow[10:30, 10:30, 10:30] = 0.0
    assert (crop_to_tet(hollow, inscribed(n))[hollow == 0] == 0).all()


@pytest.mark.parametrize(("n", "volume"), [(12, 0.03), (24, 0.01)])
def test_a_tet_of_solid_voxels_recovers_its_material(n, volume) -> None:
    # Raymont figure 7.15: within 1 % at his best resolutions, 160 voxels.
    found = macro_tet(np.ones((n, n, n)), inscribed(n), rtol=1e-4)
    cropped = crop_to_tet(np.ones((n, n, n)), inscribed(n)).sum()
    assert cropped == pytest.approx(strain_matrix(inscribed(n))[1], rel=volume)
    assert found.solid == pytest.approx(1.0)
    np.testing.assert_allclose(found.stiffness, solid_stiffness(0.3), rtol=0, atol=0.002)


def test_a_tet_of_layers_lies_above_its_periodic_value() -> None:
    # Uniform displacement of a boundary stiffens; of few layers much, of more layers less.
    values = np.where(np.arange(24) % 6 < 3, 1.0, 0.1)
    fill = np.broadcast_to(values[:, None, None], (24, 24, 24)).copy()
    found = macro_tet(fill, inscribed(24), rtol=1e-4).stiffness
    c = solid_stiffness(0.3)
    series, mean = c[0, 0] / np.mean(1 / values), c[0, 0] * values.mean()
    assert series < found[0, 0] < mean
    cube = solve_block(fill, "displacement", rtol=1e-4).stiffness
    assert cube[0, 0] < found[0, 0]


def test_a_tet_outside_its_image_is_refused() -> None:
    with pytest.raises(SolverError, match="reaches out"):
        macro_tet(np.ones((8, 8, 8)), inscribed(9))


def test_single_corner_tests_by_the_hundred() -> None:
    # All choices of six single displacements of a random tetrahedron: 3/2/1 in any order of axes
    # always works, 3/3/0 and 4/2/0 never.
    rng = np.random.default_rng(61)
    b, _ = strain_matrix(rng.standard_normal((3, 4)))
    for chosen in itertools.combinations(range(12), 6):
        count = sorted((sum(1 for c in chosen if c % 3 == axis) for axis in range(3)), reverse=True)
        rank = np.linalg.matrix_rank(b[:, chosen])
        if count == [3, 2, 1]:
            assert rank == 6
        if count in ([3, 3, 0], [4, 2, 0], [4, 1, 1]):
            assert rank < 6
