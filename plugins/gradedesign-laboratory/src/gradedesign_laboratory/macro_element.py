"""Stiffness of a linear triangle or tetrahedron from the forces of virtual tests.

The element may be a whole piece of microstructure: its corners are displaced, the forces on them
summed, and the symmetric stiffness that explains them is found by least squares. As the element's
strain is uniform, that is the apparent stiffness under uniform displacement of its boundary.

Degrees of freedom go node by node, ``x y`` or ``x y z`` of the first corner first. Voigt order is
xx, yy, xy in the plane and xx, yy, zz, yz, xz, xy in space, with engineering shear.

References
----------
A. P. Raymont, thesis, University of Exeter 2011, chapter 7.
"""

from __future__ import annotations

import numpy as np

from gradedesign import SolverError
from gradedesign.fields import FloatArray

#: Components of strain in Voigt order, by dimension.
_PAIRS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}


def strain_matrix(vertices: FloatArray) -> tuple[FloatArray, float]:
    """Matrix from corner displacements to strain, and the element's area or volume.

    Parameters
    ----------
    vertices : (2, 3) or (3, 4) array
        Corners as columns.

    Returns
    -------
    matrix : (3, 6) or (6, 12) array
    measure : float
        Of unit thickness in the plane; positive in either sense of rotation.

    Raises
    ------
    SolverError
        If the element is flat.
    """
    x = np.asarray(vertices, dtype=np.float64)
    d = x.shape[0]
    if x.shape not in ((2, 3), (3, 4)):
        raise SolverError(f"corners of shape {x.shape} are no element; expected (2, 3) or (3, 4)")
    corners = np.concatenate([np.ones((1, d + 1)), x])
    determinant = float(np.linalg.det(corners))
    if abs(determinant) <= 1e-12 * max(float(np.ptp(x, axis=1).max()), 1e-300) ** d:
        raise SolverError(f"the element with corners {x.T.tolist()} is flat; move a corner")
    # Rows: value and slopes of each linear shape function.
    slope = np.linalg.inv(corners)[:, 1:]
    matrix = np.zeros((len(_PAIRS[d]), d * (d + 1)))
    for row, (i, j) in enumerate(_PAIRS[d]):
        matrix[row, i::d] += slope[:, j]
        if i != j:
            matrix[row, j::d] += slope[:, i]
    return matrix, abs(determinant) / (2 if d == 2 else 6)


def shape_values(vertices: FloatArray, points: FloatArray) -> FloatArray:
    """Linear shape functions ``(corners, ...)`` at points ``(d, ...)``."""
    x = np.asarray(vertices, dtype=np.float64)
    inverse = np.linalg.inv(np.concatenate([np.ones((1, x.shape[1])), x]))
    homogeneous = np.concatenate([np.ones((1, *points.shape[1:])), points])
    return np.tensordot(inverse, homogeneous, axes=1)


def unit_strain_tests(vertices: FloatArray) -> FloatArray:
    """Corner displacements ``(dof, tests)`` that each strain one component by 1.

    They condition the recovery ten times better than moving one corner at a time, and never
    duplicate each other.
    """
    x = np.asarray(vertices, dtype=np.float64)
    d = x.shape[0]
    tests = []
    for i, j in _PAIRS[d]:
        strain = np.zeros((d, d))
        strain[i, j] += 0.5
        strain[j, i] += 0.5
        tests.append((strain @ x).T.ravel())
    return np.stack(tests, axis=1)


def recovery_matrix(vertices: FloatArray, displacements: FloatArray) -> FloatArray:
    """Coefficients of the upper triangle of the stiffness in the forces of tests.

    Parameters
    ----------
    vertices : (2, 3) or (3, 4) array
    displacements : (dof, tests) array

    Returns
    -------
    (tests * dof, entries) array
        Entries by rows of the upper triangle.
    """
    b, measure = strain_matrix(vertices)
    strain = b @ displacements
    n = b.shape[0]
    columns = []
    for i, j in zip(*np.triu_indices(n), strict=True):
        force = np.outer(b[i], strain[j])
        if i != j:
            force += np.outer(b[j], strain[i])
        columns.append(measure * force.T.ravel())
    return np.stack(columns, axis=1)


def recover_stiffness(
    vertices: FloatArray, displacements: FloatArray, forces: FloatArray
) -> FloatArray:
    """Symmetric stiffness that explains the corner forces of virtual tests.

    Parameters
    ----------
    vertices : (2, 3) or (3, 4) array
    displacements, forces : (dof, tests) arrays

    Returns
    -------
    (3, 3) or (6, 6) array
        Not necessarily positive definite: that is for the caller to check.

    Raises
    ------
    SolverError
        If the strains of the tests do not span all strains.
    """
    b, _ = strain_matrix(vertices)
    n = b.shape[0]
    rank = int(np.linalg.matrix_rank(b @ displacements))
    if rank < n:
        raise SolverError(
            f"the strains of the {displacements.shape[1]} tests span {rank} of {n} dimensions, so "
            f"the stiffness is not determined; use unit_strain_tests"
        )
    entries = np.linalg.lstsq(recovery_matrix(vertices, displacements), forces.T.ravel())[0]
    stiffness = np.zeros((n, n))
    stiffness[np.triu_indices(n)] = entries
    return stiffness + np.triu(stiffness, 1).T
