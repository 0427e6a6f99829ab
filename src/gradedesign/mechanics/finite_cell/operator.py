"""The stiffness of all elements as a function of displacements, without a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.finite_cell import _operator_kernels as kernels
from gradedesign.mechanics.finite_cell.basis import CUT_POINTS, WHOLE_POINTS, gauss_weights, line
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.hanging import (
    Hanging,
    fill_hanging,
    gather_hanging,
    single_hanging,
)
from gradedesign.mechanics.finite_cell.space import BrickSpace


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Springs:
    """Dense matrices that weak supports add to some elements."""

    element: IntArray  #: ``(k,)``. By colour.
    colours: IntArray  #: ``(c + 1,)``. First of each colour.
    blocks: NDArray[Any]  #: ``(k, 81, 81)``, N/mm.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Operator:
    """Arrays of a product with the stiffness, in one precision."""

    nodes: NDArray[np.int32]  #: ``(n, 27)`` int32.
    size: NDArray[np.int8]  #: ``(n,)`` int8. Edges of the elements.
    #: Colours, first element, weights, what all elements share of them, shapes and slopes of whole
    #: and of cut elements. The weights are those of the elements, in double precision.
    groups: tuple[tuple[IntArray, int, FloatArray, FloatArray, NDArray[Any], NDArray[Any]], ...]
    #: ``(2, 3, 3)``, N mm. Of `principal_moduli`, times the volume of a brick of the grid.
    moduli: NDArray[Any]
    springs: Springs | None
    hanging: Hanging | None


def operator(
    elements: Elements,
    space: BrickSpace,
    moduli: FloatArray,
    softness: float,
    springs: Springs | None = None,
) -> Operator:
    """Stiffness in double precision.

    ``space``: of order 2. ``moduli``, MPa, as `Material.moduli`. ``softness``: stiffness of the
    void in cut elements over that of the solid.
    """
    edges = elements.grid.edges
    groups = []
    for count, colours, first, weights, soft in (
        (WHOLE_POINTS, elements.colours[0], 0, np.zeros((0, WHOLE_POINTS**3)), 1.0),
        (CUT_POINTS, elements.colours[1], elements.whole, elements.weights, softness),
    ):
        if colours[-1] > colours[0]:
            own = line(count)
            slopes = np.stack([own.slopes / edge for edge in edges])
            full = gauss_weights(count)
            every = np.stack([np.full(len(full), 1.0 - softness), soft * full])
            groups.append((colours, first, weights, every, own.shapes, slopes))
    return Operator(
        nodes=space.nodes,
        size=elements.size,
        groups=tuple(groups),
        moduli=np.prod(edges) * moduli,
        springs=springs,
        hanging=space.hanging,
    )


def single(operator: Operator) -> Operator:
    """A copy in single precision that shares the weights."""
    springs = operator.springs
    if springs is not None:
        springs = Springs(
            element=springs.element,
            colours=springs.colours,
            blocks=springs.blocks.astype(np.float32),
        )
    return Operator(
        nodes=operator.nodes,
        size=operator.size,
        groups=tuple(
            (colours, first, weights, every, shapes.astype(np.float32), slopes.astype(np.float32))
            for colours, first, weights, every, shapes, slopes in operator.groups
        ),
        moduli=operator.moduli.astype(np.float32),
        springs=springs,
        hanging=single_hanging(operator.hanging),
    )


def apply(operator: Operator, u: NDArray[Any], y: NDArray[Any]) -> None:
    """Set y to K u; both are ``(N, 3)`` in the precision of the operator.

    The rows of hanging nodes are set as well: in u to what follows from the others, in y to 0.
    """
    fill_hanging(operator.hanging, u)
    y[:] = 0.0
    for colours, *group in operator.groups:
        for low, high in pairwise(colours.tolist()):
            in_ranges(
                kernels.add_product, range(low, high, kernels.LANES), operator.nodes,
                operator.size, *group, operator.moduli, u, y,
            )  # fmt: skip
    s = operator.springs
    if s is not None:
        for low, high in pairwise(s.colours.tolist()):
            in_ranges(
                kernels.add_dense, range(low, high), operator.nodes, s.element, s.blocks, u, y
            )
    gather_hanging(operator.hanging, y)


def product(operator: Operator, u: FloatArray) -> FloatArray:
    """K u as a new array."""
    y = np.zeros_like(u)
    apply(operator, u, y)
    return y
