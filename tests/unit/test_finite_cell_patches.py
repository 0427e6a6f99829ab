"""Inverses of patches in 16 bits against those of numpy in double precision."""

import numpy as np
import pytest

from gradedesign.finite_cell._patch_kernels import add_patches, invert_factors
from gradedesign.finite_cell.patches import SHIFT

#: Unknowns of a patch of all 27 nodes of an element.
WIDTH = 81


def matrices(count, condition, seed):
    """Symmetric positive definite matrices with rows of very different size."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        axes = np.linalg.qr(random.standard_normal((WIDTH, WIDTH)))[0]
        own = (axes * np.geomspace(1.0 / condition, 1.0, WIDTH)) @ axes.T
        size = np.geomspace(1.0, 1e3, WIDTH)[random.permutation(WIDTH)]
        found.append(size[:, None] * own * size)
    return np.array(found)


def solved(given, free, residual):
    """Corrections of residuals ``(k, 81)`` by patches without common nodes."""
    count = len(given)
    begin = np.arange(count + 1) * (WIDTH * (WIDTH + 1) // 2)
    first = np.arange(count + 1) * WIDTH
    scale, height = np.zeros(first[-1], np.float32), np.zeros(first[-1], np.float32)
    rows = np.zeros(begin[-1], np.int16)
    invert_factors(given.copy(), free, SHIFT, begin[:-1], first[:-1], scale, height, rows)
    nodes = np.arange(27 * count, dtype=np.int32).reshape(count, 27)
    r = residual.reshape(-1, 3).astype(np.float32)
    z = np.zeros_like(r)
    add_patches(
        np.ones(27 * count, dtype=bool), nodes, np.arange(count), np.array([0, count]), begin,
        first, scale, height, rows, np.float32(1.0), r, z,
    )  # fmt: skip
    return z.reshape(count, WIDTH).astype(np.float64)


def in_energy(matrix, vector):
    return float(np.sqrt(vector @ matrix @ vector))


@pytest.mark.parametrize(("condition", "error"), [(1e2, 1e-3), (1e5, 0.05)])
def test_corrections_are_those_of_the_inverse(condition, error):
    # A step of 16 bits is 1.5e-5 of the largest entry of a row of the factor, which is the root of
    # the condition of the scaled matrix: 81 entries of random sign make 1.5e-5 * 9 * 316 = 0.04.
    given = matrices(4, condition, 1)
    free = np.ones((4, WIDTH), np.float32)
    residual = np.random.default_rng(2).standard_normal((4, WIDTH))
    for own, right, got in zip(given, residual, solved(given, free, residual), strict=True):
        shifted = own + SHIFT * np.diag(np.diag(own))
        exact = np.linalg.solve(shifted, right)
        assert in_energy(shifted, got - exact) <= error * in_energy(shifted, exact)


def test_fixed_unknowns_stay_and_the_others_do_without_them():
    given = matrices(2, 1e2, 3)
    free = np.ones((2, WIDTH), np.float32)
    free[:, [0, 7, 80]] = 0.0
    kept = free[0] > 0
    residual = np.random.default_rng(4).standard_normal((2, WIDTH))
    for own, right, got in zip(given, residual, solved(given, free, residual), strict=True):
        exact = np.linalg.solve(own[np.ix_(kept, kept)], right[kept])
        assert (got[~kept] == 0.0).all()
        assert np.allclose(got[kept], exact, rtol=0.0, atol=2e-3 * np.abs(exact).max())


def test_rounding_leaves_the_smoother_positive():
    given = matrices(1, 1e6, 5)
    # The inverse itself, scaled to a diagonal of 1 and rounded likewise, is indefinite.
    size = np.sqrt(np.diag(given[0]))
    plain = np.linalg.inv(given[0] / size[:, None] / size + SHIFT * np.eye(WIDTH))
    size = np.sqrt(np.diag(plain))
    rounded = np.rint(plain / size[:, None] / size * 32767) / 32767
    assert np.linalg.eigvalsh(rounded).min() < 0.0
    free = np.ones((1, WIDTH), np.float32)
    basis = np.eye(WIDTH)
    inverse = np.array([solved(given, free, row[None])[0] for row in basis])
    assert np.linalg.eigvalsh((inverse + inverse.T) / 2).min() > 0.0
