"""Natural frequencies of a part on tetrahedra: small free vibrations about its supports.

Undamped and without prestress: neither loads nor prescribed displacements change the stiffness.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.fe.assembly import matvec
from gradedesign.mechanics.fe.elastic_system import ElasticSystem
from gradedesign.mechanics.fe.free_pieces import require_held
from gradedesign.mechanics.fe.mass import mass_product
from gradedesign.mechanics.fe.solve import prepared_solve
from gradedesign.mechanics.solver.lowest_modes import ModeProblem, Modes, lowest_modes

log = logging.getLogger(__name__)

#: Residual to which the solver is a preconditioner: some two to four cycles of multigrid. Chosen,
#: not measured.
_ROUGHLY = 0.1
#: Residual of modes whose frequencies alone are looked for: their error is half its square, over
#: the relative distance to the next one.
_FOUND = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeGoal:
    """A natural frequency that an analysis is to find.

    Attributes
    ----------
    load_case : str
        Whose supports hold the part.
    number : int
        Counted from 1, the lowest.
    """

    load_case: str
    number: int


def highest_mode(goals: Iterable[ModeGoal]) -> int:
    """Greatest number of any goal; 0 without any."""
    return max((goal.number for goal in goals), default=0)


def natural_modes(
    system: ElasticSystem,
    fixed: BoolArray,
    masses: FloatArray,
    count: int,
    *,
    rtol: float,
    name: str,
) -> Modes:
    """Lowest modes of a prepared system, shapes by ``3 * node + component``.

    Parameters
    ----------
    fixed : (3, N) bool array
        Held components.
    masses : (M,) array, t
        Of the tetrahedra.
    count : int
    rtol : float
        See `lowest_modes`.
    name : str
        Of the load case that holds the part.

    Raises
    ------
    SolverError
        If supports leave rigid motions free, or the iteration does not converge.
    """
    began = time.perf_counter()
    space = system.space
    require_held(space, fixed, name)
    solve = prepared_solve(system, fixed)
    free = (~fixed).T.ravel().astype(np.float64)

    def stiffness(x: FloatArray) -> FloatArray:
        return free * np.asarray(matvec(system.matrix, x.reshape(-1, 3).T)).T.ravel()

    def mass(x: FloatArray) -> FloatArray:
        return free * mass_product(space, masses, x)

    def precondition(forces: FloatArray) -> FloatArray:
        return np.asarray(solve(forces, np.zeros_like(forces), _ROUGHLY).x)

    problem = ModeProblem(
        stiffness=stiffness,
        mass=mass,
        precondition=precondition,
        start=[free * np.ascontiguousarray(u.T).ravel() for u in _first_guesses(system)],
    )
    with stepping(f"natural frequencies of {name}"):
        modes = lowest_modes(problem, count, rtol=rtol, name=name)
    log.info(
        "'%s': %d natural frequencies from %.4g Hz, %d iterations in %.2f s",
        name, count, modes.frequencies[0], modes.iterations, time.perf_counter() - began,
    )  # fmt: skip
    return modes


def found_frequencies(
    system: ElasticSystem,
    held: Mapping[str, BoolArray],
    masses: FloatArray,
    goals: Mapping[Hashable, ModeGoal],
) -> dict[Hashable, float]:
    """Natural frequencies by the keys of goals, Hz.

    Parameters
    ----------
    held : mapping of load case to (3, N) bool array
        Components that its supports hold.
    masses : (M,) array, t
    """
    found: dict[Hashable, float] = {}
    for name in dict.fromkeys(goal.load_case for goal in goals.values()):
        own = {key: goal for key, goal in goals.items() if goal.load_case == name}
        count = highest_mode(own.values())
        modes = natural_modes(system, held[name], masses, count, rtol=_FOUND, name=name)
        found |= {key: float(modes.frequencies[g.number - 1]) for key, g in own.items()}
    return found


def _first_guesses(system: ElasticSystem) -> list[FloatArray]:
    """Displacements of similar problems, or else motions that are linear in place, (3, N)."""
    if system.earlier:
        return list(system.earlier)
    nodes = system.space.nodes
    centred = nodes - nodes.mean(axis=1, keepdims=True)
    fields = [np.ones(nodes.shape[1]), *centred]
    return [axis[:, None] * field for axis in np.eye(3) for field in fields]
