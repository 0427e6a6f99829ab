"""Supports: which displacement components are prescribed, and to what value."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import BoolArray, FloatArray, lock
from gradedesign.errors import CaseError
from gradedesign.mechanics.fe.facets import facet_nodes
from gradedesign.mechanics.fe.space import TetSpace

#: Prescribed displacement in x, y and z, mm; ``None`` leaves a component free.
Displacement: TypeAlias = tuple[float | None, float | None, float | None]

#: Two prescriptions of one component may differ by rounding only, relative to the larger one.
_AGREEMENT = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Supports:
    """Prescribed displacement components of a space with N nodes."""

    fixed: BoolArray  #: ``(3, N)``. True where the component is prescribed.
    #: ``(3, N)``, mm. The prescribed displacement; 0 where nothing is prescribed.
    value: FloatArray

    def __post_init__(self) -> None:
        lock(self, dtype=bool, fixed=(3, None))
        lock(self, value=self.fixed.shape)
        if self.value[~self.fixed].any():
            raise ValueError(
                "a displacement other than 0 is given for a component that is not fixed"
            )


def disagrees(one: ArrayLike, other: ArrayLike) -> BoolArray:
    """Whether displacements of one component differ by more than rounding."""
    one, other = np.asarray(one), np.asarray(other)
    scale = np.maximum(np.abs(one), np.abs(other))
    return np.asarray(np.abs(one - other) > _AGREEMENT * scale)


def supports_at(space: TetSpace, prescribed: Iterable[tuple[ArrayLike, Displacement]]) -> Supports:
    """Prescribe the displacement of sets of nodes.

    Raises `CaseError` if two entries ask for different displacements of the same node.

    ``prescribed``: iterable of (nodes, displacement); node indices ``(k,)`` and the displacement in
    x, y, z, mm; ``None`` is free.
    """
    shape = space.nodes.shape
    fixed = np.zeros(shape, dtype=bool)
    value = np.zeros(shape)
    for nodes, displacement in prescribed:
        chosen = np.unique(np.asarray(nodes, dtype=np.int64))
        for component, component_value in enumerate(displacement):
            if component_value is None:
                continue
            _refuse_conflict(space, fixed, value, chosen, component, float(component_value))
            fixed[component, chosen] = True
            value[component, chosen] = component_value
    return Supports(fixed=fixed, value=value)


def supports_on(space: TetSpace, prescribed: Iterable[tuple[ArrayLike, Displacement]]) -> Supports:
    """Prescribe the displacement of all nodes, edge middles included, of sets of facets.

    Raises `CaseError` if two entries ask for different displacements of the same node, and
    `SolverError` if a set is empty or holds something that is no face of the mesh.

    ``prescribed``: iterable of (facets, displacement); vertex indices ``(k, 3)`` and the
    displacement in x, y, z, mm; ``None`` is free.

    Examples
    --------
    A clamp on one face and an enforced displacement along x on another::

        supports_on(space, [(root, (0.0, 0.0, 0.0)), (tip, (0.1, None, None))])
    """
    return supports_at(
        space, [(facet_nodes(space, facets).ravel(), wanted) for facets, wanted in prescribed]
    )


def _refuse_conflict(
    space: TetSpace,
    fixed: BoolArray,
    value: FloatArray,
    nodes: ArrayLike,
    component: int,
    stated: float,
) -> None:
    """Raise if a node is already held at another displacement in this component."""
    index = np.asarray(nodes, dtype=np.int64)
    clash = fixed[component, index] & disagrees(value[component, index], stated)
    if clash.any():
        node = int(index[np.argmax(clash)])
        x, y, z = space.nodes[:, node]
        raise CaseError(
            f"two supports prescribe the {'xyz'[component]} displacement of "
            f"{np.count_nonzero(clash)} common nodes differently: {value[component, node]:g} mm "
            f"and {stated:g} mm at ({x:g}, {y:g}, {z:g}) mm; free that component in one of them "
            "or choose regions that do not touch"
        )
