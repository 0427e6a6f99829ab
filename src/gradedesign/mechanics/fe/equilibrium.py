"""Reactions, strain energy and balance of forces of a displacement solution."""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.mechanics.fe.assembly import matvec
from gradedesign.mechanics.fe.solution import Balance, LoadVector, Solution
from gradedesign.mechanics.fe.space import TetSpace

#: Largest true residual and imbalance that is ever accepted. Chosen, not measured.
ACCEPTED = 1e-6
#: Imbalance counts against the loads, or against this share of the forces that one node's
#: displacement alone would need if that is more (`ACCEPTED` of it is 50 units of rounding): a body
#: that its supports move without strain has no loads to compare with.
ROUNDING = 1e-8


def right_hand_side(matrix: bsr_matrix, case: LoadVector) -> FloatArray:
    """Loads less the forces of the prescribed displacements, interleaved ``(3 n,)``, N."""
    force = case.force
    if case.supports.value.any():
        force = force - matvec(matrix, case.supports.value)
    return np.ascontiguousarray(force.T).ravel()


def evaluate(
    space: TetSpace,
    matrix: bsr_matrix,
    case: LoadVector,
    x: FloatArray,
    right: FloatArray,
    *,
    iterations: int,
    method: str,
) -> Solution:
    """Complete the answer of a solver.

    Raises `SolverError` if the displacement holds NaN or infinity. Returns Solution: sound or not:
    see `defects`.

    Parameters
    ----------
    matrix : bsr_matrix
        Without supports.
    x : (3 n,) array, mm
        Displacement of the free components, interleaved; 0 where fixed.
    right : (3 n,) array, N
        What x was solved for; 0 where fixed.
    iterations, method
        As the solution shall report them.
    """
    if not np.isfinite(x).all():
        raise SolverError(
            f"load case '{case.name}': {method} returned {np.count_nonzero(~np.isfinite(x))} "
            f"displacements that are not finite"
        )
    fixed = case.supports.fixed
    u = x.reshape(-1, 3).T + case.supports.value
    internal = matvec(matrix, u)
    reaction = np.where(fixed, internal - case.force, 0.0)
    unbalanced = np.where(fixed, 0.0, case.force - internal)
    size = float(np.linalg.norm(right))
    energy = 0.5 * float((u * internal).sum())
    work = 0.5 * float((u * (case.force + reaction)).sum())
    noise = ROUNDING * np.abs(matrix.diagonal().reshape(-1, 3).T * u)
    return Solution(
        name=case.name,
        displacement=u,
        reaction=reaction,
        energy=energy,
        residual=float(np.linalg.norm(unbalanced)) / size if size > 0.0 else 0.0,
        iterations=iterations,
        method=method,
        balance=Balance(
            **_imbalance(space.nodes, case.force, reaction, float(noise.sum())),
            energy=_share(abs(energy - work), max(energy, float((noise * np.abs(u)).sum()))),
        ),
    )


def defects(solution: Solution) -> str:
    """List the reasons why a solution cannot be accepted; empty if there are none."""
    shares = {
        "the residual": solution.residual,
        "the sum of forces": solution.balance.force,
        "the sum of moments": solution.balance.moment,
        "the balance of energy": solution.balance.energy,
    }
    violations = [
        f"{name} is off by {share:.2e}" for name, share in shares.items() if not share <= ACCEPTED
    ]
    return f"{', '.join(violations)} where {ACCEPTED:g} is accepted" if violations else ""


def _imbalance(
    nodes: FloatArray, force: FloatArray, reaction: FloatArray, noise: float
) -> dict[str, float]:
    """Resultant force and moment of loads and reactions, as shares of their size."""
    total = force + reaction
    arms = nodes - nodes.mean(axis=1, keepdims=True)
    size = max(
        float(np.linalg.norm(force, axis=0).sum() + np.linalg.norm(reaction, axis=0).sum()),
        noise,
    )
    diagonal = float(np.linalg.norm(np.ptp(nodes, axis=1)))
    moment = np.cross(arms, total, axis=0).sum(axis=1)
    return {
        "force": _share(float(np.linalg.norm(total.sum(axis=1))), size),
        "moment": _share(float(np.linalg.norm(moment)), size * diagonal),
    }


def _share(part: float, whole: float) -> float:
    """Quotient that is 0 for 0 / 0."""
    return part / whole if whole > 0.0 else (0.0 if part == 0.0 else np.inf)
