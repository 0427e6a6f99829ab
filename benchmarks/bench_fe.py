"""Assembly and multigrid on a solid box and on a gyroid block, beside the targets.

    python benchmarks/bench_fe.py                  # box of 1.08 M unknowns
    python benchmarks/bench_fe.py gyroid           # gyroid sheet by fTetWild, 2 x 2 x 2 cells
    python benchmarks/bench_fe.py gyroid 3 18      # 3 x 3 x 3 cells, 18 elements a cell
    python benchmarks/bench_fe.py peer             # beside scikit-fem and pypardiso, 107 k unknowns

Seconds are wall time; processor seconds in brackets tell how busy the machine was otherwise.
What was measured: ``bench_fe.md``.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from skfem import MeshTet

from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.tets.meshed_surface import tetrahedralize
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern
from gradedesign.mechanics.fe.multigrid import build_hierarchy, preconditioner
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import predict_memory_bytes, solve_elastic
from gradedesign.mechanics.fe.space import TetSpace, skfem_mesh, tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.solver.conjugate_gradients import conjugate_gradients


def box_mesh(n: int) -> TetMesh:
    """A cantilever of 4 x 1 x 1 mm with n cubes of six tets across."""
    grid = MeshTet.init_tensor(*[np.linspace(0.0, a, a * n + 1) for a in (4, 1, 1)])
    tets = np.array(grid.t)
    edges = grid.p[:, tets[1:]] - grid.p[:, tets[:1]]
    negative = np.linalg.det(edges.transpose(2, 0, 1)) < 0
    tets[:2, negative] = tets[1::-1, negative]
    return TetMesh(points=grid.p, tets=tets)


def gyroid_mesh(cells: int, cubes: int = 16) -> TetMesh:
    """A block of gyroid sheet of 1 mm cells, relative density about 0.2, with end plates."""

    def field(p: np.ndarray) -> np.ndarray:
        x, y, z = 2 * np.pi * p
        f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
        plates = np.minimum(p[2], cells - p[2]) - 0.125
        half = 0.5 * cells
        block = np.max(np.abs(p - half), axis=0) - half
        return np.maximum(np.minimum((np.abs(f) - 0.32) / 7.0, plates), block)

    h = 1.0 / cubes
    surface = extract_surface(field, np.zeros(3), np.full(3, float(cells)), h)
    limits = {"time_limit_s": 3600.0, "memory_limit_bytes": 12 << 30}
    return tetrahedralize(surface, edge_length=h, epsilon=0.05 * h, **limits).mesh


def contrast(mesh: TetMesh, ratio: float) -> np.ndarray:
    """A smooth modulus between 1 / ratio and 1 MPa."""
    x, y, z = mesh.points[:, mesh.tets].mean(axis=1)
    return ratio ** (-0.5 * (1.0 + np.sin(3 * x) * np.cos(5 * y) * np.sin(4 * z)))


def own_weight(space: TetSpace, axis: int) -> LoadVector:
    """A unit body force against z, clamped at the lowest end of an axis."""
    volumes = signed_volumes(space.mesh)
    weights = {1: [0.25] * 4, 2: [-0.05] * 4 + [0.2] * 6}[space.order]
    force = np.zeros(space.nodes.shape)
    for nodes, weight in zip(space.elements, weights, strict=True):
        force[2] -= np.bincount(nodes, weight * volumes, minlength=space.node_count)
    lowest = space.nodes[axis].min()
    fixed = np.repeat((space.nodes[axis] < lowest + 1e-6)[None], 3, axis=0)
    return LoadVector(
        name="weight", supports=Supports(fixed=fixed, value=np.zeros(fixed.shape)), force=force
    )


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print wall and processor seconds of a block, and the peak memory so far."""
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"  {what:34s} {time.perf_counter() - wall:7.2f} s ({time.process_time() - cpu:6.2f} s "
        f"of processors), peak {peak:.2f} GiB",
        flush=True,
    )


def bench(make: Callable[[], TetMesh], order: int, ratio: float, axis: int) -> None:
    """Time every stage of one problem."""
    with timed("mesh"):
        mesh = make()
    with timed("space"):
        space = tet_space(mesh, order)
    stiffness = IsotropicStiffness(E=contrast(mesh, ratio), nu=0.3)
    print(f"order {order}: {space.element_count} tets, {space.dof_count} unknowns")
    with timed("pattern"):
        pattern = assembly_pattern(space)
    with timed("assembly"):
        matrix = assemble(pattern, stiffness)
    case = own_weight(space, axis)
    with timed("multigrid setup"):
        hierarchy = build_hierarchy(space, stiffness, matrix, case.supports.fixed)
    keep = (~case.supports.fixed.T).ravel().astype(float)
    with timed("conjugate gradients, 1e-8"):
        end = conjugate_gradients(
            matrix, keep, keep * case.force.T.ravel()[None], preconditioner(hierarchy, 1),
            rtol=1e-8, max_iterations=300,
        )  # fmt: skip
    print(
        f"  {end.iterations[0]} iterations, residual {end.residual[0]:.1e}, levels "
        f"{hierarchy.sizes}"
    )
    other = replace(case, name="turned", force=case.force[[1, 2, 0]])
    both = keep * np.stack([c.force.T.ravel() for c in (case, other)])
    with timed("the same, two load cases together"):
        conjugate_gradients(
            matrix, keep, both, preconditioner(hierarchy, 2), rtol=1e-8, max_iterations=300
        )
    del matrix, hierarchy, end
    with timed("solve_elastic, all checks"):
        (solution,) = solve_elastic(space, stiffness, [case])
    predicted = predict_memory_bytes(space.dof_count, order)
    print(
        f"  {solution.method}, {solution.iterations} iterations, residual "
        f"{solution.residual:.1e}, {solution.balance}, predicted {predicted / 2**30:.2f} GiB"
    )


def peer() -> None:
    """The same 107 k unknowns by scikit-fem's assembly and by pypardiso."""
    from pypardiso import spsolve
    from skfem import Basis, BilinearForm, ElementTetP2, ElementVector
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = box_mesh(10)
    space = tet_space(mesh, 2)
    stiffness = IsotropicStiffness(E=np.ones(space.element_count), nu=0.3)
    case = own_weight(space, 0)
    with timed("scikit-fem assembly"):
        form: BilinearForm = linear_elasticity(*lame_parameters(1.0, 0.3))
        theirs = form.assemble(Basis(skfem_mesh(space), ElementVector(ElementTetP2()), intorder=2))
    with timed("our pattern and assembly"):
        ours = assemble(assembly_pattern(space), stiffness)
    print(f"  largest difference {abs(ours.tocsr() - theirs).max():.1e}")
    free = np.flatnonzero(~case.supports.fixed.T.ravel())
    with timed("pypardiso"):
        x = spsolve(theirs[free][:, free].tocsr(), case.force.T.ravel()[free])
    with timed("solve_elastic, all checks"):
        (solution,) = solve_elastic(space, stiffness, [case])
    difference = abs(solution.displacement.T.ravel()[free] - x).max() / abs(x).max()
    print(f"  largest difference {difference:.1e} of the largest displacement")


def main(what: str) -> None:
    """Warm the compiled kernels on a small problem, then run one benchmark."""
    bench(lambda: box_mesh(6), 2, 10.0, 0)
    print(flush=True)
    if what == "peer":
        peer()
    elif what == "gyroid":
        size = [int(text) for text in sys.argv[2:4]] or [2]
        bench(lambda: gyroid_mesh(*size), 2, 1.0, 2)
    else:
        bench(lambda: box_mesh(int(sys.argv[2]) if len(sys.argv) > 2 else 22), 2, 10.0, 0)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "box")
