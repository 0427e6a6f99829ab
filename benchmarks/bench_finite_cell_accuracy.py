"""Finite cells against body-fitted tetrahedra of the same field: work of the loads, side by side.

``python benchmarks/bench_finite_cell_accuracy.py [cell density cells ...]``, cells as 2x1x1. Blocks
of unit cells between plates of an eighth are pressed, sheared and bent. Tetrahedra take two
elements across the thinnest wall or plate and half as many again; their limit follows with order 2.
Finite cells take the spacing that a run takes and a finer one, as acceptance does, and their band.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))

BLOCKS = (
    ("gyroid-sheet", 0.3, "1x1x1"), ("gyroid-sheet", 0.3, "2x1x1"), ("gyroid-sheet", 0.15, "1x1x1"),
    ("primitive-sheet", 0.3, "1x1x1"), ("primitive-sheet", 0.3, "2x1x1"), ("sc", 0.2, "2x1x1"),
    ("bcc", 0.2, "2x1x1"), ("octet", 0.3, "1x1x1"),
)  # fmt: skip
#: Spacing of the first finite cells over the next, and tetrahedra across a wall.
RATIO, ACROSS = 1.5, (2.0, 3.0)
#: Tetrahedra whose finest mesh is this far from their limit say nothing of finite cells.
CONVERGED = 0.05


def block_of(name, rho, cells):
    """A block of cells between plates as a finite-cell problem, and its thinnest wall."""
    from finite_cell_solids import box_face, box_field, load_case, newtons, problem

    from gradedesign.design.resolve.registry import lookup
    from gradedesign.geometry.cell.calibration import calibrate
    from gradedesign.geometry.cell.wall_size import wall_mm
    from gradedesign.mechanics.finite_cell.grid import Plane
    from gradedesign.program.host.registry import build_registry

    cell = calibrate(lookup(build_registry(), "cell_families", name))
    level, high = float(cell.level_of(rho)), tuple(map(float, cells))
    box, scale = box_field((0, 0, 0), high), 1.0 if cell.axes else 8.0

    def field(points):
        lattice = (cell.family.shape(points, **cell.parameters) - level) / scale
        plate = np.minimum(points[0], high[0] - points[0]) - 0.125
        return np.maximum(np.minimum(lattice, plate), box(points))

    regions = {side: box_face(side, (0, 0, 0), high, 0, k) for k, side in enumerate(("x0", "x1"))}
    bend = {"force": newtons(0, 0, 0), "moment": ["0 N mm", "1 N mm", "0 N mm"]}
    loads = {
        "press": {"force": newtons(-1, 0, 0)},
        "shear": {"force": newtons(0, 0, 1)},
        "bend": bend,
    }
    cases = [load_case(k, [("x0", "xyz")], [("x1", load)]) for k, load in loads.items()]
    planes = tuple(Plane(axis=0, place=p, area=1.0) for p in (0.125, high[0] - 0.125))
    solid = problem(field, (0, 0, 0), high, cases, regions, planes=planes)
    return cell, solid, float(wall_mm(cell, rho, 1.0))


def residual_of(result, case):
    """Residual of the tractions in a load case."""
    return next(s.traction_residual for s in result.solutions if s.name == case)


def compare(name, rho, cells):
    """Print limits of tetrahedra, bands of finite cells and what both took."""
    from finite_cell_solids import analyse
    from test_finite_cells import tetrahedra_of

    from gradedesign.mechanics.explicit.finite_cells import ORDERS, elements_per_wall
    from gradedesign.mechanics.limits.banded import Residual, banded

    cell, solid, wall = block_of(name, rho, cells)
    began, found = time.process_time(), []
    thin = min(wall, 0.125)
    for across in ACROSS:
        shape = tuple(int(np.ceil(across / thin)) * c for c in cells)
        work = tetrahedra_of(solid, (0, 0, 0), shape, cells[0] / shape[0])
        found.append((cells[0] / shape[0], {k: v[0] for k, v in work.items()}))
    tets = time.process_time() - began
    began, spacing = time.process_time(), wall / elements_per_wall(cell, rho)
    coarse, fine = analyse(solid, spacing), analyse(solid, spacing / RATIO)
    took = time.process_time() - began
    print(
        f"{name} {rho:g}, {'x'.join(map(str, cells))}: tetrahedra {tets:.0f} s, finite cells "
        f"{took:.0f} s ({coarse.unknowns}, {fine.unknowns} unknowns, "
        f"{max(s.iterations for s in fine.solutions)} iterations)"
    )
    for case in coarse.work:
        known = banded([(h, work[case]) for h, work in found], (2.0, 2.0, 2.0))
        residuals = [residual_of(r, case) for r in (coarse, fine)]
        band = banded(
            [(r.spacing, r.work[case]) for r in (coarse, fine)],
            ORDERS,
            [Residual(rise=r) for r in residuals],
        )
        inside = "in the band" if band.low <= known.value <= band.high else "OUTSIDE THE BAND"
        finest = found[-1][1][case] / known.value - 1
        if abs(finest) > CONVERGED:
            inside = "tetrahedra have not converged"
        print(
            f"  {case}: tetrahedra {known.value:.4g} N mm (finest {finest:+.1%}); "
            f"finite cells {coarse.work[case] / known.value - 1:+.1%}, "
            f"{fine.work[case] / known.value - 1:+.1%}, band {band.low / known.value - 1:+.1%} to "
            f"{band.high / known.value - 1:+.1%}, half {band.half_width:.1%}, "
            f"residual {residuals[1]:.2f}: {inside}",
            flush=True,
        )


if __name__ == "__main__":
    asked = sys.argv[1:]
    blocks = [asked[k : k + 3] for k in range(0, len(asked), 3)] or BLOCKS
    for name, rho, cells in blocks:
        compare(name, float(rho), tuple(map(int, cells.split("x"))))
