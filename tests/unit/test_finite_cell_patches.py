"""Inverses of patches in 8 bits against those of numpy in double precision."""

import numpy as np
import pytest

from gradedesign.mechanics.finite_cell._patch_kernels import invert_factors
from gradedesign.mechanics.finite_cell.patches import SHIFT, Patches, add_patches

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
    rows = np.zeros(begin[-1], np.int8)
    invert_factors(0, count, given.copy(), free, SHIFT, begin[:-1], first[:-1], scale, height, rows)
    nodes = np.arange(27 * count, dtype=np.int32).reshape(count, 27)
    r = residual.reshape(-1, 3).astype(np.float32)
    z = np.zeros_like(r)
    patches = Patches(
        nodes=nodes, weak=np.ones(27 * count, dtype=bool), chosen=np.arange(count),
        colours=np.array([0, count]), begin=begin, first=first, scale=scale, height=height,
        rows=rows,
    )  # fmt: skip
    add_patches(patches, np.float32(1.0), r, z)
    return z.reshape(count, WIDTH).astype(np.float64)


def in_energy(matrix, vector):
    return float(np.sqrt(vector @ matrix @ vector))


@pytest.mark.parametrize(("condition", "error"), [(1e0, 1e-6), (1e2, 0.2)])
def test_corrections_are_those_of_the_inverse(condition, error):
    # Rounding to 8 bits errs by 1 / 254 / sqrt(3) = 0.0023 of the largest entry of a row of the
    # factor, at most the root of the condition of the scaled matrix. Of 81 entries of random sign
    # that is 0.0023 * 9 * 10 = 0.2 at a condition of 100; a diagonal matrix has nothing to round.
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
        among = own[np.ix_(kept, kept)]
        exact = np.linalg.solve(among, right[kept])
        assert (got[~kept] == 0.0).all()
        # As above.
        error = 0.0023 * 9 * 10
        assert in_energy(among, got[kept] - exact) <= error * in_energy(among, exact)
        with_them = np.linalg.solve(own, right)[kept]
        assert in_energy(among, with_them - exact) > error * in_energy(among, exact)


def test_rounding_leaves_the_smoother_positive():
    given = matrices(1, 1e6, 5)
    # The inverse itself, scaled to a diagonal of 1 and rounded likewise, is indefinite.
    size = np.sqrt(np.diag(given[0]))
    plain = np.linalg.inv(given[0] / size[:, None] / size + SHIFT * np.eye(WIDTH))
    size = np.sqrt(np.diag(plain))
    rounded = np.rint(plain / size[:, None] / size * 127) / 127
    assert np.linalg.eigvalsh(rounded).min() < 0.0
    free = np.ones((1, WIDTH), np.float32)
    basis = np.eye(WIDTH)
    inverse = np.array([solved(given, free, row[None])[0] for row in basis])
    assert np.linalg.eigvalsh((inverse + inverse.T) / 2).min() > 0.0
