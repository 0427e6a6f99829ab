"""Geometric stiffness of finite cells: what a stress adds to the stiffness of a displaced solid.

Its element matrices join equal components of the displacement alone, and these alike, so that 27 by
27 numbers are kept of each, in single precision. As in the mass, the void of cut elements has no
part in them: it carries no stress. In cut elements the stress is the mean over their solid: their
weights integrate what a stress that varies would make only roughly, and slivers would buckle by
themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.finite_cell.basis import (
    CUT_POINTS,
    WHOLE_POINTS,
    gauss_places,
    gauss_weights,
    gradients_at,
)
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.hanging import fill_hanging, gather_hanging
from gradedesign.mechanics.finite_cell.space import BrickSpace

#: Elements worked on at once: their stresses stay in the cache. Chosen, not measured.
_CHUNK = 512
#: Voigt components xx, yy, zz, yz, xz, xy of a tensor, and how often each stands in it.
_FIRST, _SECOND = np.array([[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]])
_ROWS, _COLUMNS = np.triu_indices(27)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GeometricStiffness:
    """Element matrices of one load case."""

    elements: Elements
    space: BrickSpace
    blocks: NDArray[np.float32]  #: ``(n, 27, 27)`` float32, N/mm.


def geometric_stiffness(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    moduli: FloatArray,
    thermal_strain: float,
) -> GeometricStiffness:
    """Geometric stiffness of the stress of displacements.

    - ``space``: of order 2
    - ``u (N, 3)``, mm
    - ``moduli``, MPa, as `Material.moduli`
    - ``thermal_strain``: free strain of the solid
    """
    blocks = np.zeros((len(elements.position), 27, 27), np.float32)
    u = np.array(u)
    fill_hanging(space.hanging, u)
    whole = range(elements.whole)
    cut = range(elements.whole, len(elements.position))
    for count, group in ((WHOLE_POINTS, whole), (CUT_POINTS, cut)):
        gradients = gradients_at(gauss_places(count), elements.grid.edges)
        work = _work_of_stress(gradients) * float(np.prod(elements.grid.edges))
        flat, full = gradients.reshape(-1, 27), gauss_weights(count)
        for part in _parts(group.start, group.stop):
            size = elements.size[part].astype(np.float64)
            moved = u[space.nodes[part]].transpose(1, 0, 2).reshape(27, -1)
            slope = (flat @ moved).reshape(len(full), 3, -1, 3) / size[:, None]
            if count == CUT_POINTS:
                own = slice(part.start - elements.whole, part.stop - elements.whole)
                weights = elements.weights[own].T
            else:
                weights = np.broadcast_to(full[:, None], (len(full), size.size))
            stress = _stress(slope, moduli, thermal_strain) * weights
            if count == CUT_POINTS:
                stress = weights * (stress.sum(axis=1) / weights.sum(axis=0))[:, None]
            stress *= size
            upper = (work @ stress.reshape(6 * len(full), -1).astype(np.float32)).T
            blocks[part, _ROWS, _COLUMNS] = upper
            blocks[part, _COLUMNS, _ROWS] = upper
    return GeometricStiffness(elements=elements, space=space, blocks=blocks)


def geometric_product(geometric: GeometricStiffness, u: FloatArray) -> FloatArray:
    """Product with nodal values ``(N, 3)``, whose hanging rows are set."""
    space, blocks = geometric.space, geometric.blocks
    fill_hanging(space.hanging, u)
    out = np.zeros_like(u)
    for colours in geometric.elements.colours:
        # Elements of one colour share no node, so that their forces are added at once.
        for low, high in pairwise(colours.tolist()):
            nodes = space.nodes[low:high]
            out[nodes] += np.matmul(blocks[low:high], u[nodes].astype(np.float32))
    gather_hanging(space.hanging, out)
    return out


def _work_of_stress(gradients: FloatArray) -> NDArray[np.float32]:
    """Upper triangle of the element matrix by the stress at its points, ``(378, 6 Q)``.

    ``gradients (Q, 3, 27)``: of the shape functions, for a brick of the grid.
    """
    one, other = gradients[..., _ROWS], gradients[..., _COLUMNS]
    products = one[:, _FIRST] * other[:, _SECOND] + one[:, _SECOND] * other[:, _FIRST]
    products[:, :3] *= 0.5
    return products.transpose(2, 1, 0).reshape(len(_ROWS), -1).astype(np.float32)


def _stress(slope: FloatArray, moduli: FloatArray, thermal_strain: float) -> FloatArray:
    """Voigt stress ``(6, Q, m)``, MPa, of derivatives by axis and component, ``(Q, 3, m, 3)``."""
    normal, shear = moduli
    strains = np.stack([slope[:, a, :, a] for a in range(3)]) - thermal_strain
    sheared = [
        shear[a, b] * (slope[:, a, :, b] + slope[:, b, :, a])
        for a, b in zip(_FIRST[3:], _SECOND[3:], strict=True)
    ]
    return np.concatenate([np.tensordot(normal, strains, axes=1), np.stack(sheared)])


def _parts(start: int, stop: int) -> Iterator[slice]:
    """Slices of a range of elements that are worked on at once."""
    for first in range(start, stop, _CHUNK):
        yield slice(first, min(first + _CHUNK, stop))
