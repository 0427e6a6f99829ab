"""The lowest modes of ``K x = value M x``, by locally optimal block preconditioned iterations.

``M`` is the mass, and values are squares of angular frequencies; or ``M`` is what a load takes off
the stiffness, which may be negative, and positive values are the factors at which it buckles.

Of every vector the residual, preconditioned, and the last step widen the space in which the best
vectors are taken next; all modes that are looked for are taken together, so that equal ones do not
hide each other. Vectors are normalised by ``K``, which supports make positive, and not by ``M``,
which thin slivers of a solid leave nearly singular.

References
----------
A. V. Knyazev (2001), Toward the optimal preconditioned eigensolver, SIAM J. Sci. Comput. 23, 517.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, locked
from gradedesign.common.system.progress import report_step
from gradedesign.errors import SolverError

_Product: TypeAlias = Callable[[FloatArray], FloatArray]

#: Modes that are iterated beyond those asked for: the error of the last one falls with its distance
#: from the first that is left out, and two cover a pair of equal bending modes.
GUARD = 2
#: Load factors lie close together: so many modes are iterated at least. Chosen, not measured.
LEAST_BLOCK = 5
#: Directions whose share of a space is below this, in energy, are left out: products of
#: combinations lose the root of it in digits, again in every iteration. With 1e-12 five load
#: factors of a column whose next two lay within 0.1 % drifted apart from their shapes.
_DEPENDENT = 1e-8
#: Most iterations. With one multigrid cycle for each some 15 to 30 are taken. Chosen, not measured.
MAX_ITERATIONS = 200
#: Residual that is accepted where iterations end before the one asked for: the error of a frequency
#: is some half of its square over the relative distance to the next one. Chosen, not measured.
ACCEPTED = 1e-3
#: Seed of the vectors that are added to the first guess, so that no symmetry hides a mode.
_SEED = 2029


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeProblem:
    """Stiffness and mass of n unknowns."""

    #: Products with ``K`` and ``M``, ``(n,)`` to ``(n,)``.
    stiffness: _Product
    mass: _Product
    #: Products of k vectors with about the inverse of ``K``, ``(k, n)`` to ``(k, n)``.
    precondition: _Product
    #: Each ``(n,)``. Vectors of which the best combinations are where the iteration
    #: starts.
    start: Sequence[FloatArray]
    #: Values of the modes in words, and why there may be none.
    of: str = "natural frequencies"
    none: str = "the solid has no mass, so that it has no natural frequency"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Modes:
    """Lowest modes, in order."""

    #: ``(k,)``. Squares of the angular frequencies, 1/s^2, or factors of the load; all positive.
    values: FloatArray
    shapes: FloatArray  #: ``(k, n)``. Normalised so that the work ``x K x`` is 1.
    #: ``(k,)``. Of every mode relative to its work, in the norm of the preconditioner.
    residuals: FloatArray
    iterations: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", locked(self.values, (None,), name="values"))
        shape = (self.values.size, None)
        object.__setattr__(self, "shapes", locked(self.shapes, shape, name="shapes"))

    @property
    def frequencies(self) -> FloatArray:
        """Natural frequencies, ``(k,)``, Hz."""
        return np.asarray(np.sqrt(self.values) / (2.0 * np.pi))


@dataclass(slots=True)
class _Block:
    """Vectors with their products, each ``(k, n)``."""

    x: FloatArray
    stiff: FloatArray
    heavy: FloatArray

    def chosen(self, which: BoolArray) -> _Block:
        """Some of the vectors."""
        return _Block(self.x[which], self.stiff[which], self.heavy[which])

    def combined(self, weights: FloatArray) -> _Block:
        """Combinations of the vectors by columns of ``weights`` ``(k, m)``."""
        return _Block(weights.T @ self.x, weights.T @ self.stiff, weights.T @ self.heavy)


def lowest_modes(
    problem: ModeProblem, count: int, *, rtol: float, name: str = "", guard: int = GUARD
) -> Modes:
    """Lowest modes of a held solid, of positive values.

    Raises `SolverError` if the iteration does not converge, or there is no mode.

    ``rtol``: residual at which the iteration ends. That of a frequency is about half its square.
    ``name``: of the load case, for messages. ``guard``: modes that are iterated beyond those asked
    for.
    """
    block = _first_block(problem, count + guard, name)
    wanted = min(count, len(block.x))
    step: _Block | None = None
    residual = np.zeros(0)
    done = 0
    while True:
        inverse = _diagonal(block)
        rest = block.heavy - inverse[:, None] * block.stiff
        ahead = problem.precondition(rest)
        size = np.where(inverse > 0.0, inverse, inverse[0])
        residual = np.sqrt(np.maximum(np.einsum("kn,kn->k", rest, ahead), 0.0)) / size
        worst = float(residual[:wanted].max())
        if worst <= rtol or done >= MAX_ITERATIONS:
            break
        done += 1
        report_step(problem.of, _won(worst, rtol))
        # Vectors beyond those asked for go on as long as these do. The last step of one that has
        # converged is rounding, of which its products know nothing.
        active = residual > 0.1 * rtol
        widened = _with_products(problem, ahead[active])
        block, step = _best(block, widened, None if step is None else step.chosen(active))
    if not worst <= max(rtol, ACCEPTED):
        raise SolverError(
            f"load case '{name}': the lowest {count} {problem.of} stopped after {done} "
            f"iterations at a residual of {worst:.1e}, where {ACCEPTED:g} is accepted; take a "
            f"finer mesh or another [run] solver"
        )
    found = np.flatnonzero(inverse[:wanted] > 0.0)
    return Modes(
        values=1.0 / inverse[found],
        shapes=block.x[found],
        residuals=residual[found],
        iterations=done,
    )


def lowest_factors(problem: ModeProblem, count: int, *, rtol: float, name: str) -> Modes:
    """Lowest factors of a load at which a held solid buckles, see `lowest_modes`.

    The mass of the problem is what the load takes off the stiffness. Raises `SolverError` if the
    iteration does not converge, or the load compresses nothing.
    """
    buckling = replace(
        problem,
        of="load factors of buckling",
        none=(
            "its loads compress nothing, so that nothing buckles; leave it out of [limits] "
            "part_buckling, which takes the load_case that it is meant for"
        ),
    )
    guard = max(LEAST_BLOCK - count, GUARD)
    return lowest_modes(buckling, count, rtol=rtol, name=name, guard=guard)


def _first_block(problem: ModeProblem, count: int, name: str) -> _Block:
    """Best vectors in the span of the first guesses and of what some forces cause, ``(count, n)``.

    The forces of a random acceleration hold a share of every mode.
    """
    start = [np.asarray(x, dtype=np.float64) for x in problem.start]
    size = start[0].size
    random = np.random.default_rng(_SEED)
    forces = np.array([problem.mass(random.standard_normal(size)) for _ in range(count)])
    start += [*problem.precondition(forces)]
    wide = _with_products(problem, np.array(start))
    weights, inverse = _ritz([wide])
    if not inverse[0] > 0.0:
        raise SolverError(f"load case '{name}': {problem.none}")
    return wide.combined(weights[:, :count])


def _with_products(problem: ModeProblem, x: FloatArray) -> _Block:
    """Vectors of unit work with their products."""
    stiff = np.array([problem.stiffness(v) for v in x]).reshape(x.shape)
    work = np.einsum("kn,kn->k", x, stiff)
    some = work > 0.0
    scale = 1.0 / np.sqrt(work[some])[:, None]
    x, stiff = scale * x[some], scale * stiff[some]
    heavy = np.array([problem.mass(v) for v in x]).reshape(x.shape)
    return _Block(x, stiff, heavy)


def _diagonal(block: _Block) -> FloatArray:
    """Reciprocals of the values of the vectors, ``(k,)``."""
    heavy = np.einsum("kn,kn->k", block.x, block.heavy)
    return np.asarray(heavy / np.einsum("kn,kn->k", block.x, block.stiff))


def _best(block: _Block, ahead: _Block, step: _Block | None) -> tuple[_Block, _Block]:
    """Best vectors in the span of blocks, and their parts outside the first block."""
    others = [ahead] if step is None else [ahead, step]
    weights, _ = _ritz([block, *others])
    k = len(block.x)
    weights = weights[:, :k]
    parts, start = [], k
    for other in others:
        parts.append(other.combined(weights[start : start + len(other.x)]))
        start += len(other.x)
    moved = parts[0] if step is None else _sum(*parts)
    return _sum(block.combined(weights[:k]), moved), moved


def _sum(a: _Block, b: _Block) -> _Block:
    return _Block(a.x + b.x, a.stiff + b.stiff, a.heavy + b.heavy)


def _ritz(blocks: Sequence[_Block]) -> tuple[FloatArray, FloatArray]:
    """Combinations of vectors that are modes in their span, lowest first.

    Returns ``weights (m, r)``: normalised by the stiffness; dependent directions are left out;
    ``inverse (r,)``: reciprocals of their values, largest first.
    """
    stiff = np.block([[a.x @ b.stiff.T for b in blocks] for a in blocks])
    heavy = np.block([[a.x @ b.heavy.T for b in blocks] for a in blocks])
    stiff, heavy = 0.5 * (stiff + stiff.T), 0.5 * (heavy + heavy.T)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(stiff), np.finfo(float).tiny))
    energy, axes = np.linalg.eigh(stiff * np.outer(scale, scale))
    free = energy > _DEPENDENT * energy[-1]
    basis = scale[:, None] * axes[:, free] / np.sqrt(energy[free])
    inverse, turned = np.linalg.eigh(basis.T @ heavy @ basis)
    return basis @ turned[:, ::-1], inverse[::-1]


def _won(residual: float, rtol: float) -> float:
    """Share of the way to a residual."""
    if residual <= 0.0:
        return 1.0
    return float(np.clip(np.log(1.0 / residual) / np.log(1.0 / rtol), 0.0, 1.0))
