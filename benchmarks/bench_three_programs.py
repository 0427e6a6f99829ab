"""One block by finite cells, by our tetrahedra, and by CalculiX on a mesh of its surface.

``python benchmarks/bench_three_programs.py [cell density cells]``, 3x3x3 gyroid sheets of density
0.3 by default, pressed between plates of an eighth. Finite cells and tetrahedra take the field at
two spacings; CalculiX takes quadratic tetrahedra with which fTetWild fills the contoured surface,
of two sizes, and solves them itself. Every pair is extrapolated with order 2, the finite cells' by
the band that acceptance makes. Without ``ccx`` it says so and compares the other two.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "cases"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

#: Edges of CalculiX' tetrahedra over a cell; half as many grid steps of the contour.
EDGES = (0.17, 0.12)
#: Spacing of our tetrahedra's grid over a cell, and of finite cells.
GRIDS, BRICKS = (0.07, 0.05), (0.07, 0.05)


def model_of(solid, mesh, tolerance):
    """Quadratic elements, stiffness and load vector of the load case ``press`` on a mesh."""
    from finite_cell_solids import STEEL

    from gradedesign.fe.load_case import case_loads, load_vector
    from gradedesign.fe.space import tet_space
    from gradedesign.fe.stiffness import IsotropicStiffness
    from gradedesign.part.part_mesh import region_facets

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


def by_tetrahedra(solid, high, h):
    """Work of the load case by stuffed tetrahedra on a grid of ``h``, N mm, and its unknowns."""
    from gradedesign.fe.solve import solve_elastic
    from gradedesign.mesh.stuffing import stuff

    mesh = stuff(solid.field, (0, 0, 0), tuple(round(x / h) for x in high), h)
    space, stiffness, vector = model_of(solid, mesh, 0.01 * h)
    (solution,) = solve_elastic(space, stiffness, [vector])
    return float((vector.force * solution.displacement).sum()), 3 * space.nodes.shape[1]


def by_calculix(solid, high, edge):
    """Work of the load case by CalculiX on fTetWild's tetrahedra, N mm, and its unknowns."""
    from test_calculix_decks import displacements

    from gradedesign.lattice.surface import extract_surface
    from gradedesign.mesh.meshed_surface import tetrahedralize
    from gradedesign.output.calculix import Deck, DeckStep, write_calculix

    surface = extract_surface(solid.field, (0, 0, 0), high, edge / 3)
    mesh = tetrahedralize(
        surface, edge_length=edge, epsilon=edge / 40, time_limit_s=3600, memory_limit_bytes=12 << 30
    ).mesh
    space, stiffness, vector = model_of(solid, mesh, 0.1 * edge)
    step = DeckStep(name="press", supports=vector.supports, force=vector.force, displacement=0.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "block.inp"
        write_calculix(path, Deck(title=["block"], space=space, stiffness=stiffness, steps=[step]))
        # Its direct solver would take tens of gigabytes.
        words = path.read_text().replace("*STATIC", "*STATIC, SOLVER=ITERATIVE CHOLESKY")
        path.write_text(words)
        (moved,) = displacements(path)
    return float((vector.force * moved.T).sum()), 3 * space.nodes.shape[1]


def compare(name, rho, cells):
    """Print what the three say, two values each, and their limits over CalculiX'."""
    from bench_finite_cell_accuracy import block_of, residual_of

    from gradedesign.finite_cell import analyse
    from gradedesign.limits.banded import banded
    from gradedesign.verify.finite_cells import ORDERS

    _, solid, _ = block_of(name, rho, cells)
    high, limits = tuple(map(float, cells)), {}
    print(f"{name} {rho:g}, {'x'.join(map(str, cells))}: work of the load, N mm")
    programs = [("tetrahedra", GRIDS, by_tetrahedra)]
    if shutil.which("ccx") is None:
        print("  CalculiX is not compared: no program ccx")
    else:
        programs.insert(0, ("CalculiX", EDGES, by_calculix))
    for program, sizes, solve in programs:
        began = time.perf_counter()
        found = [solve(solid, high, size) for size in sizes]
        values = [(size, work) for size, (work, _) in zip(sizes, found, strict=True)]
        limits[program] = banded(values, (2.0, 2.0, 2.0)).value
        unknowns = found[-1][1]
        report(program, [work for work, _ in found], limits, unknowns, began)
    began = time.perf_counter()
    solved = [analyse(solid, size) for size in BRICKS]
    values = [(r.spacing, r.work["press"]) for r in solved]
    band = banded(values, ORDERS, [residual_of(r, "press") for r in solved])
    limits["finite cells"] = band.value
    report("finite cells", [v for _, v in values], limits, solved[-1].unknowns, began)
    print(f"  band of finite cells {band.low:.5g} to {band.high:.5g}")


def report(program, works, limits, unknowns, began):
    """One row of the table."""
    peer = next(iter(limits))
    ratio = limits[program] / limits[peer] - 1.0
    print(
        f"  {program}: {', '.join(f'{w:.5g}' for w in works)}, limit {limits[program]:.5g} "
        f"({ratio:+.2%} of {peer}), {unknowns} unknowns, {time.perf_counter() - began:.0f} s",
        flush=True,
    )


if __name__ == "__main__":
    name, rho, cells = sys.argv[1:] or ("gyroid-sheet", "0.3", "3x3x3")
    compare(name, float(rho), tuple(map(int, cells.split("x"))))
