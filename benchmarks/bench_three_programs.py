"""One block by finite cells, and by tetrahedra of its surface in our solver and in CalculiX.

``python benchmarks/bench_three_programs.py [cell density cells]``, 3x3x3 gyroid sheets of density
0.3 by default, pressed between plates of an eighth. Finite cells take the field at three spacings;
both others take quadratic tetrahedra with which fTetWild fills one fine contour, of two sizes, and
solve them themselves. Each program's works are extrapolated as acceptance does. Tetrahedra of
fTetWild are finer than asked where its envelope is narrow, so their size is the edge of the cube
that five of them fill on average. Without ``ccx`` it says so and compares the other two.
What was measured: ``bench_three_programs.md``.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

#: Spacing of the contour that tetrahedra fill, over a cell, and the distance within which
#: its triangles are made fewer: the sheets are 1/10 thick.
CONTOUR, CHORD = 0.0125, 2e-3
#: Edges that fTetWild is asked for, over a cell, and the distances within which it follows the
#: contour, which decide on the size of most tetrahedra.
EDGES = ((0.2, 1e-2), (0.1, 4e-3))
#: Bricks along a cell, in one ratio as nearly as whole bricks of the block allow.
BRICKS = (43 / 3, 60 / 3, 84 / 3)
#: Tetrahedra in a cube, for their size.
IN_A_CUBE = 5


def model_of(solid, mesh, tolerance):
    """Quadratic elements, stiffness and load vector of the load case ``press`` on a mesh."""
    from finite_cell_solids import STEEL

    from gradedesign.geometry.part.part_mesh import region_facets
    from gradedesign.mechanics.fe.load_case import case_loads, load_vector
    from gradedesign.mechanics.fe.space import tet_space
    from gradedesign.mechanics.fe.stiffness import IsotropicStiffness

    space = tet_space(mesh, 2)
    facets = {
        n: region_facets(mesh, r.corners, tolerance=tolerance).facets
        for n, r in solid.regions.items()
    }
    stiffness = IsotropicStiffness(
        E=np.full(space.element_count, STEEL.youngs_modulus), nu=STEEL.poissons_ratio
    )
    density = np.full(space.element_count, STEEL.density)
    (press,) = case_loads(space, solid.cases[:1], solid.regions, facets)
    return space, stiffness, load_vector(space, press, stiffness, density, 0.0)


def by_tetrahedra(solid, mesh, edge):
    """Size, work by our own solver on tetrahedra, N mm, unknowns and volume."""
    from gradedesign.mechanics.fe.solve import solve_elastic

    space, stiffness, vector = model_of(solid, mesh, 0.1 * edge)
    (solution,) = solve_elastic(space, stiffness, [vector])
    work = float((vector.force * solution.displacement).sum())
    return size_of(mesh), work, 3 * space.nodes.shape[1], volume_of(mesh)


def size_of(mesh):
    """Edge of the cube that `IN_A_CUBE` tetrahedra fill on average."""
    return (IN_A_CUBE * volume_of(mesh) / mesh.tets.shape[1]) ** (1 / 3)


def volume_of(mesh):
    """Volume of tetrahedra, mm^3."""
    from gradedesign.geometry.tets.tet_mesh import signed_volumes

    return float(signed_volumes(mesh).sum())


def contour_of(solid, high):
    """The surface that tetrahedra fill."""
    from gradedesign.geometry.contour.surface import extract_surface
    from gradedesign.geometry.triangles.chord_tolerance import within_chord

    return within_chord(extract_surface(solid.field, (0, 0, 0), high, CONTOUR), CHORD)


def mesh_of(surface, edge, envelope):
    """FTetWild's tetrahedra of a surface."""
    from gradedesign.geometry.tets.meshed_surface import tetrahedralize

    limits = {"time_limit_s": 3600, "memory_limit_bytes": 12 << 30}
    return tetrahedralize(surface, edge_length=edge, epsilon=envelope, **limits).mesh


def by_calculix(solid, mesh, edge):
    """Size, work by CalculiX on tetrahedra, N mm, unknowns and volume."""
    from oracles.calculix import run_calculix

    from gradedesign.program.outputs.analysed_model import AnalysedModel, ModelStep
    from gradedesign_calculix.calculix import write_calculix

    space, stiffness, vector = model_of(solid, mesh, 0.1 * edge)
    step = ModelStep(name="press", supports=vector.supports, force=vector.force, displacement=0.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "block.inp"
        model = AnalysedModel(
            name="block", title=["block"], space=space, stiffness=stiffness, steps=[step]
        )
        write_calculix(path, model)
        # Its direct solver would take tens of gigabytes.
        words = path.read_text().replace("*STATIC", "*STATIC, SOLVER=ITERATIVE CHOLESKY")
        path.write_text(words)
        (moved,) = run_calculix(path)["DISP"]
    work = float((vector.force * moved.T).sum())
    return size_of(mesh), work, 3 * space.nodes.shape[1], volume_of(mesh)


def by_finite_cells(solid, per_cell):
    """Result of finite cells, as many along a cell."""
    from finite_cell_solids import analyse

    return analyse(solid, 1.0 / per_cell)


def compare(name, rho, cells):
    """Print the works of the three programs, and their limits over CalculiX'."""
    from bench_finite_cell_accuracy import block_of, residual_of

    _, solid, _ = block_of(name, rho, cells)
    high, limits = tuple(map(float, cells)), {}
    print(f"{name} {rho:g}, {'x'.join(map(str, cells))}: work of the load, N mm")
    surface = contour_of(solid, high)
    meshes = [(mesh_of(surface, edge, envelope), edge) for edge, envelope in EDGES]
    began = time.perf_counter()
    if shutil.which("ccx") is None:
        print("  CalculiX is not compared: no program ccx")
    else:
        report("CalculiX", [by_calculix(solid, *one) for one in meshes], limits, began)
    began = time.perf_counter()
    report("tetrahedra", [by_tetrahedra(solid, *one) for one in meshes], limits, began)
    began = time.perf_counter()
    solved = [by_finite_cells(solid, n) for n in BRICKS]
    rows = [(r.spacing, r.work["press"], r.unknowns, r.volume) for r in solved]
    report("finite cells", rows, limits, began, [residual_of(r, "press") for r in solved])


def report(program, rows, limits, began, residuals=None):
    """Print size, work, unknowns and volume of each resolution, and the limit with its band."""
    from gradedesign.mechanics.explicit.finite_cells import ORDERS
    from gradedesign.mechanics.limits.banded import Residual, banded

    for size, work, unknowns, volume in rows:
        print(
            f"  {program}: {work:.5g} on elements of {size:.3g}, {unknowns} unknowns, "
            f"volume {volume:.4f}"
        )
    band = banded(
        [(size, work) for size, work, *_ in rows],
        ORDERS,
        residuals and [Residual(rise=r) for r in residuals],
    )
    peer = limits.setdefault("peer", (program, band.value))
    print(
        f"  {program}: limit {band.value:.5g} ({band.value / peer[1] - 1.0:+.2%} of {peer[0]}), "
        f"band {band.low:.5g} to {band.high:.5g}, order {band.order}, "
        f"{time.perf_counter() - began:.0f} s",
        flush=True,
    )


if __name__ == "__main__":
    name, rho, cells = sys.argv[1:] or ("gyroid-sheet", "0.3", "3x3x3")
    compare(name, float(rho), tuple(map(int, cells.split("x"))))
