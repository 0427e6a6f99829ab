"""Natural frequencies of a solid on finite cells: small free vibrations about its supports."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.finite_cell.held_system import HeldSystem
from gradedesign.mechanics.finite_cell.mass import mass_product
from gradedesign.mechanics.finite_cell.operator import product
from gradedesign.mechanics.solver.lowest_modes import ModeProblem, Modes, lowest_modes

log = logging.getLogger(__name__)

#: Residual of the modes: the error of a frequency is half its square, over the relative distance to
#: the next one.
_RTOL = 1e-3


def natural_modes(
    system: HeldSystem, density: float, count: int, similar: Sequence[FloatArray], name: str
) -> Modes:
    """Lowest modes of a solid that is held; shapes are ``(N, 3)`` arrays, flat.

    Parameters
    ----------
    density : float, t/mm^3
    count : int
    similar : sequence of (N, 3) arrays
        Displacements of load cases of the same supports, to start from.
    name : str
        Of the load case that holds the solid.

    Raises
    ------
    SolverError
        If the iteration does not converge.
    """
    began = time.perf_counter()
    keep, shape = system.keep, system.keep.shape

    def stiff(x: FloatArray) -> FloatArray:
        return (product(system.stiffness, _copied(x, shape)) * keep).ravel()

    def mass(x: FloatArray) -> FloatArray:
        return (
            mass_product(system.elements, system.space, density, _copied(x, shape)) * keep
        ).ravel()

    def inverse(forces: FloatArray) -> FloatArray:
        out = np.zeros_like(forces)
        for force, found in zip(forces, out, strict=True):
            system.precondition(force.reshape(shape), found.reshape(shape))
        return out

    moved = [np.broadcast_to(axis, shape) for axis in np.eye(3)]
    problem = ModeProblem(
        stiffness=stiff,
        mass=mass,
        precondition=inverse,
        start=[(u * keep).ravel() for u in (*similar, *moved)],
    )
    with stepping(f"natural frequencies of {name}"):
        modes = lowest_modes(problem, count, rtol=_RTOL, name=name)
    log.info(
        "'%s': %d natural frequencies from %.4g Hz, %d iterations, residual %.1e, in %.2f s",
        name, count, modes.frequencies[0], modes.iterations, modes.residuals.max(),
        time.perf_counter() - began,
    )  # fmt: skip
    return modes


def _copied(x: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Nodal values of a vector; products set the rows of hanging nodes in them."""
    return np.array(x.reshape(shape))
