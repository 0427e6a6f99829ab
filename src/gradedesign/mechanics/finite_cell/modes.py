"""Modes of a solid on finite cells: natural vibrations about its supports, buckling under loads."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.finite_cell.geometric_stiffness import (
    geometric_product,
    geometric_stiffness,
)
from gradedesign.mechanics.finite_cell.held_system import HeldSystem
from gradedesign.mechanics.finite_cell.mass import mass_product
from gradedesign.mechanics.finite_cell.operator import product
from gradedesign.mechanics.solver.lowest_modes import (
    ModeProblem,
    Modes,
    lowest_factors,
    lowest_modes,
)

log = logging.getLogger(__name__)

#: Residual of the modes: the error of a frequency is half its square, and that of a load factor its
#: square, over the relative distance to the next one.
_RTOL = 1e-3

_Product: TypeAlias = Callable[[FloatArray], FloatArray]


def natural_modes(
    system: HeldSystem, density: float, count: int, similar: Sequence[FloatArray], name: str
) -> Modes:
    """Lowest natural modes of a solid that is held; shapes are ``(N, 3)`` arrays, flat.

    Raises `SolverError` if the iteration does not converge.

    ``density``, t/mm^3. ``similar``, each ``(N, 3)``: displacements of load cases of the same
    supports, to start from. ``name``: of the load case that holds the solid.
    """
    began = time.perf_counter()
    problem = _problem(
        system, lambda x: mass_product(system.elements, system.space, density, x), similar
    )
    with stepping(f"natural frequencies of {name}"):
        modes = lowest_modes(problem, count, rtol=_RTOL, name=name)
    log.info(
        "'%s': %d natural frequencies from %.4g Hz, %d iterations, residual %.1e, in %.2f s",
        name, count, modes.frequencies[0], modes.iterations, modes.residuals.max(),
        time.perf_counter() - began,
    )  # fmt: skip
    return modes


def buckling_modes(
    system: HeldSystem,
    stressed: tuple[FloatArray, float],
    moduli: FloatArray,
    similar: Sequence[FloatArray],
    name: str,
) -> Modes:
    """The mode in which a solid buckles first; its value is the factor of its loads.

    Raises `SolverError` if nothing is compressed, or the iteration does not converge.

    - ``stressed``: displacements of the load case, ``(N, 3)``, mm, and the free strain of the solid
      in it
    - ``moduli``, MPa, as `Material.moduli`
    - ``similar``, each ``(N, 3)``: to start from
    - ``name``: of the load case
    """
    began = time.perf_counter()
    geometric = geometric_stiffness(system.elements, system.space, stressed[0], moduli, stressed[1])
    problem = _problem(system, lambda x: -geometric_product(geometric, x), similar)
    with stepping(f"buckling under {name}"):
        modes = lowest_factors(problem, 1, rtol=_RTOL, name=name)
    log.info(
        "'%s': buckles at %.4g times its loads, %d iterations, residual %.1e, in %.2f s",
        name, modes.values[0], modes.iterations, modes.residuals.max(),
        time.perf_counter() - began,
    )  # fmt: skip
    return modes


def _problem(system: HeldSystem, mass: _Product, similar: Sequence[FloatArray]) -> ModeProblem:
    """Modes of a held system, of a mass that is given for nodal values ``(N, 3)``."""
    keep, shape = system.keep, system.keep.shape

    def stiff(x: FloatArray) -> FloatArray:
        return (product(system.stiffness, _copied(x, shape)) * keep).ravel()

    def inverse(forces: FloatArray) -> FloatArray:
        out = np.zeros_like(forces)
        for force, found in zip(forces, out, strict=True):
            system.precondition(force.reshape(shape), found.reshape(shape))
        return out

    moved = [np.broadcast_to(axis, shape) for axis in np.eye(3)]
    return ModeProblem(
        stiffness=stiff,
        mass=lambda x: (mass(_copied(x, shape)) * keep).ravel(),
        precondition=inverse,
        start=[(u * keep).ravel() for u in (*similar, *moved)],
    )


def _copied(x: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Nodal values of a vector; products set the rows of hanging nodes in them."""
    return np.array(x.reshape(shape))
