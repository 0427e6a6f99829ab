"""Macroscopic stresses to test a cell with."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from gradedesign.arrays import FloatArray

#: Share of directions within 40 degrees of hydrostatic; the rest is uniform on the sphere. So that
#: these, a narrow cone of all six dimensions, are not missed. Chosen, not measured.
_NEAR_HYDROSTATIC = 0.2
#: Factors by which the Voigt components of a stress enter its Frobenius norm.
FROBENIUS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


def named_directions() -> dict[str, FloatArray]:
    """Uniaxial, shear, equibiaxial and deviatoric stresses along and between the cell's axes.

    Returns each ``(6, k)``: stresses in Voigt order xx, yy, zz, yz, xz, xy, each of unit von Mises
    stress; all equivalents under cubic symmetry, none twice: 63 in all.
    """
    axes = {
        "100": [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        "110": [(1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)],
        "111": [(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)],
    }
    unit = {k: [np.array(a) / np.linalg.norm(a) for a in v] for k, v in axes.items()}
    by_name: dict[str, list[FloatArray]] = {}
    for name, normals in unit.items():
        for n in normals:
            along = np.outer(n, n)
            by_name.setdefault(f"uniaxial {name}", []).append(along)
            by_name.setdefault(f"biaxial {name}", []).append(np.eye(3) - along)
            by_name.setdefault(f"deviatoric {name}", []).append(along - np.eye(3) / 3)
    everything = [(name, n) for name, normals in unit.items() for n in normals]
    for (plane, n), (direction, m) in combinations(everything, 2):
        if abs(n @ m) < 1e-12:
            high, low = sorted((plane, direction), reverse=True)
            by_name.setdefault(f"shear {high}<{low}>", []).append(np.outer(n, m) + np.outer(m, n))
    directions: dict[str, FloatArray] = {}
    seen: list[FloatArray] = []
    for name, tensors in by_name.items():
        stresses = [_voigt(t) for t in tensors]
        unique = []
        for s in (s / von_mises_of(s) for s in stresses):
            if not any(np.allclose(s, t) or np.allclose(s, -t) for t in seen):
                seen.append(s)
                unique.append(s)
        if unique:
            directions[name] = np.stack(unique, axis=1)
    return directions


def spread_directions(count: int, rng: np.random.Generator) -> FloatArray:
    """Random stresses of unit Frobenius norm, some of them close to hydrostatic.

    Returns ``(6, count)``.
    """
    normal = rng.standard_normal((6, count))
    normal /= np.linalg.norm(normal, axis=0)
    close = round(_NEAR_HYDROSTATIC * count)
    if close:
        mean = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]) / np.sqrt(3)
        across = normal[:, :close] - np.outer(mean, mean @ normal[:, :close])
        across /= np.linalg.norm(across, axis=0)
        angle = np.radians(rng.uniform(0.0, 40.0, close))
        normal[:, :close] = np.outer(mean, np.cos(angle)) + across * np.sin(angle)
    # Components of the orthonormal basis to those of the tensor.
    return normal / np.sqrt(FROBENIUS)[:, None]


def von_mises_of(stress: FloatArray) -> FloatArray:
    """Von Mises stress ``(...)`` of Voigt stresses ``(6, ...)``."""
    x, y, z, yz, xz, xy = stress
    square = 0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) + 3 * (yz**2 + xz**2 + xy**2)
    return np.asarray(np.sqrt(square))


def _voigt(tensor: FloatArray) -> FloatArray:
    """Voigt components of a stress tensor."""
    return np.array([tensor[i, i] for i in range(3)] + [tensor[1, 2], tensor[0, 2], tensor[0, 1]])
