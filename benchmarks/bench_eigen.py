"""Own Lanczos iteration against scipy's eigsh and lobpcg for the buckling loads of cells.

All solve with the same preconditioned conjugate gradients; run with a number of voxels across.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh, lobpcg

from gradedesign.arrays import FloatArray
from gradedesign.homogenise import buckling
from gradedesign.homogenise.extreme_values import extreme_values
from gradedesign.homogenise.operator import voxel_operator
from gradedesign.homogenise.periodic import solve_periodic

NU = 0.3
#: Residual of the values, as `extreme_values` asks for.
TOLERANCE = 3e-3


def sheet(n: int, rho: float) -> FloatArray:
    """Voxels of a gyroid sheet."""
    u = 2 * np.pi * (np.indices((n, n, n)) + 0.5) / n
    x, y, z = u
    f = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))
    return (f <= np.quantile(f, rho)).astype(float)


def main(n: int) -> None:
    """Print values, solves and seconds of every solver."""
    fill = sheet(n, 0.2)
    solution = solve_periodic(fill, poissons_ratio=NU)
    operator = voxel_operator(fill, NU)
    for name, macro in (("compression", [-1.0, 0, 0, 0, 0, 0]), ("shear", [0, 0, 0, 0, 0, 1.0])):
        stress = buckling.macro_prestress(solution, np.array(macro))
        for both in (False, True):
            for label, solver in (("lanczos", None), ("eigsh", arpack), ("lobpcg", block)):
                bench(f"{name}, {'both ends' if both else 'one end'}", fill, stress, operator, both,
                      label, solver)  # fmt: skip


def bench(
    what: str,
    fill: FloatArray,
    stress: FloatArray,
    operator: Any,
    both: bool,
    label: str,
    solver: Callable[..., list[float]] | None,
) -> None:
    """Run one solver on the operators that buckling hands to its own."""
    count = 0

    def replaced(form: Any, solve: Any, start: FloatArray, **options: Any) -> Any:
        nonlocal count

        def counted(force: FloatArray) -> FloatArray:
            nonlocal count
            count += 1
            return np.asarray(solve(force))

        if solver is None:
            return extreme_values(form, counted, start, **options)

        def product(x: FloatArray) -> FloatArray:
            y = np.zeros((3, *fill.shape))
            operator.product(x.reshape(y.shape), y)
            return y.ravel()

        values = solver(form, counted, product, start, options["both"])
        raise Done(values)

    original = buckling.extreme_values
    buckling.extreme_values = replaced
    start = np.random.default_rng(7).standard_normal((3, *fill.shape))
    began, used = time.perf_counter(), time.process_time()
    try:
        high, low = buckling.weakest_modes(fill, stress, poissons_ratio=NU, start=start, both=both)
        values = [high.value] + ([low.value] if low else [])
    except Done as done:
        values = done.values
    finally:
        buckling.extreme_values = original
    print(
        f"{what}, {label}: {' '.join(f'{v:.5g}' for v in values)}, {count} solves, "
        f"{time.process_time() - used:.1f} s of processor, {time.perf_counter() - began:.1f} s",
        flush=True,
    )


class Done(Exception):
    """Values found by another solver."""

    def __init__(self, values: list[float]) -> None:
        self.values = values


def arpack(form: Any, solve: Any, product: Any, start: FloatArray, both: bool) -> list[float]:
    """Implicitly restarted Lanczos."""
    n = start.size
    make = lambda f: LinearOperator((n, n), matvec=f, dtype=float)  # noqa: E731
    values = eigsh(
        make(form), k=2 if both else 1, M=make(product), Minv=make(solve), v0=solve(form(start)),
        which="BE" if both else "LA", tol=TOLERANCE, return_eigenvectors=False,
    )  # fmt: skip
    return sorted(map(float, values), reverse=True)


def block(form: Any, solve: Any, product: Any, start: FloatArray, both: bool) -> list[float]:
    """Locally optimal block preconditioned conjugate gradients, one block for each end."""
    n = start.size
    rng = np.random.default_rng(3)
    ends = []
    for largest in (True, False)[: 1 + both]:
        x = np.stack([solve(form(v)) for v in (start, rng.permutation(start))], axis=1)
        make = lambda f: LinearOperator(  # noqa: E731
            (n, n), matvec=f, matmat=lambda X: np.stack([f(c) for c in X.T], axis=1), dtype=float
        )
        values, _ = lobpcg(
            make(form), x, B=make(product), M=make(solve), tol=None, maxiter=20, largest=largest
        )
        ends.append(float(values.max() if largest else values.min()))
    return ends


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
