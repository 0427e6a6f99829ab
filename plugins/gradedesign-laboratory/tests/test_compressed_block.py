"""Blocks between plates: against another assembly, and an exact solution."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg
from skfem import Basis, ElementHex1, ElementVector, MeshHex, condense
from skfem.models.elasticity import lame_parameters, linear_elasticity

from gradedesign import DensityError
from gradedesign.commands import build_registry
from gradedesign.properties import calibrate
from gradedesign_laboratory.compressed_block import compressed_modulus, compressed_ratio


def by_skfem(fill, nu):
    """The same trilinear voxels, assembled whole: force on the upper plate over area and strain."""
    axes = [np.arange(n + 1.0) for n in fill.shape]
    mesh = MeshHex.init_tensor(*axes)
    basis = Basis(mesh, ElementVector(ElementHex1()), intorder=3)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    scale = fill[tuple(np.floor(middle).astype(int))]
    stiffness = None
    for value in np.unique(scale[scale > 0]):
        part = basis.with_elements(np.flatnonzero(scale == value))
        one = linear_elasticity(*lame_parameters(value, nu)).assemble(part)
        stiffness = one if stiffness is None else stiffness + one
    height = mesh.p[2, basis.get_dofs().flatten() // 3].max()
    ends = np.concatenate([
        basis.get_dofs(lambda x, z=z: np.isclose(x[2], z)).flatten() for z in (0.0, height)
    ])  # fmt: skip
    x = np.zeros(basis.N)
    top = basis.get_dofs(lambda x: np.isclose(x[2], height)).all("u^3")
    x[top] = 1.0
    loose = np.flatnonzero(np.asarray(abs(stiffness).sum(axis=1)).ravel() == 0.0)
    matrix, right, x, inner = condense(stiffness, x=x, D=np.union1d(ends, loose))
    x[inner] = scipy.sparse.linalg.spsolve(matrix.tocsc(), right)
    force = float((stiffness @ x)[top].sum())
    return force * height / (fill.shape[0] * fill.shape[1])


@pytest.mark.parametrize("nu", [0.0, 0.34])
def test_a_block_of_random_voxels_equals_another_assembly(nu):
    rng = np.random.default_rng(271)
    fill = np.where(rng.random((5, 4, 6)) < 0.25, 0.0, rng.choice([0.4, 1.0], (5, 4, 6)))
    fill[1:3, 1:3] = 1.0  # what stands is held by a column through the block
    found = compressed_modulus(fill, poissons_ratio=nu, rtol=1e-10)
    assert found == pytest.approx(by_skfem(fill, nu), rel=1e-8)


def test_a_column_that_does_not_spread_has_the_modulus_of_the_solid():
    assert compressed_modulus(np.ones((4, 4, 6)), poissons_ratio=0.0) == pytest.approx(1.0)
    half = np.zeros((4, 4, 6))
    half[:2] = 1.0
    assert compressed_modulus(half, poissons_ratio=0.0) == pytest.approx(0.5)


def test_a_block_between_plates_is_as_stiff_as_the_printed_surface():
    """Finite cells on the printed surface of 2^3 cells of bcc at 0.3 between plates, E 110 GPa and
    nu 0.3, give 4173 MPa (3986 to 4437, elements of 0.27 and 0.18 mm for struts of 1.08 mm), of
    3^3 cells 4147 MPa; the law of the cell is 3316.5 MPa.

    Held at the inner faces of the plates the block would have 1.51 times the law's.
    """
    cell = calibrate(build_registry().cell_families["bcc"], {})
    ratio = compressed_ratio(cell, 0.3, 2, plate=0.375, pairs=[(16, 24)])
    assert 3986 / 3316.5 < ratio < 4437 / 3316.5
    # By pairs of finer grids 1.284 and 1.280.
    assert ratio == pytest.approx(1.282, rel=0.015)
    assert compressed_ratio(cell, 0.3, 2, plate=0.01, pairs=[(16, 24)]) > 1.1 * ratio


def test_walls_too_thin_for_the_grids_are_refused():
    cell = calibrate(build_registry().cell_families["bcc"], {})
    with pytest.raises(DensityError, match=r"at density 0\.01 has walls of 0\..* a denser block"):
        compressed_ratio(cell, 0.01, 2, plate=0.4, pairs=[(3, 4), (4, 6)])
