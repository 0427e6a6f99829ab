"""The ends of the spectrum of a symmetric form relative to a stiffness, by Lanczos iterations."""

from __future__ import annotations

import numpy as np

from gradedesign import EigenProblem, EigenSolver, ExtremeValue, SolverError

#: Residual of a value relative to it. The value's own error is its square over the relative
#: distance to the next value, 2e-4 where that is 5 %.
_RTOL = 3e-3
#: A rest smaller than this share of the largest value is rounding error: nothing is left to find.
_EXHAUSTED = 1e-12


def lanczos(
    problem: EigenProblem, *, most_steps: int = 240
) -> tuple[ExtremeValue, ExtremeValue | None]:
    """Largest and, on request, smallest ``mu`` of ``form x = mu K x``; one solve a step.

    Parameters
    ----------
    most_steps : int
        Solves.

    Returns
    -------
    tuple of ExtremeValue
        Largest, and smallest or None.

    Raises
    ------
    SolverError
        If the steps do not suffice.
    """
    form, solve, start = problem.form, problem.solve, problem.start
    both, negligible = problem.both, problem.negligible
    force = form(start)
    x = solve(force)
    size = max(float(x @ force), 0.0) ** 0.5
    if size == 0:
        none = ExtremeValue(value=0.0, vector=np.zeros_like(start))
        return none, none if both else None
    basis, forces = [x / size], [force / size]
    diagonal: list[float] = []
    beside: list[float] = []
    for _ in range(most_steps):
        force = form(basis[-1])
        x = solve(force)
        diagonal.append(float(basis[-1] @ force))
        # Against the whole basis and twice: rounding would bring found vectors back.
        for _ in range(2):
            share = np.array([b @ force for b in basis])
            for c, b, f in zip(share, basis, forces, strict=True):
                x = x - c * b
                force = force - c * f
        rest = max(float(x @ force), 0.0) ** 0.5
        values, vectors = np.linalg.eigh(
            np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
        )
        largest = float(np.abs(values).max())
        done = []
        for end in (-1, 0)[: 1 + both]:
            residual = rest * abs(float(vectors[-1, end]))
            # The wanted side of zero only: an end that lies beyond is an end of the other kind.
            value = max(float(values[end]) if end else -float(values[end]), 0.0)
            if value + residual <= negligible * largest:
                done.append(ExtremeValue(value=0.0, vector=np.zeros_like(start)))
            elif residual <= _RTOL * value:
                shape = np.sum([s * b for s, b in zip(vectors[:, end], basis, strict=True)], axis=0)
                done.append(ExtremeValue(value=float(values[end]), vector=shape))
        if len(done) == 1 + both:
            return done[0], done[1] if both else None
        if rest <= _EXHAUSTED * largest:
            break
        beside.append(rest)
        basis.append(x / rest)
        forces.append(force / rest)
    raise SolverError(
        f"the lowest buckling load was not found in {most_steps} solves; take fewer voxels or "
        f"another macroscopic stress"
    )


LANCZOS = EigenSolver(name="lanczos", solve=lanczos)
