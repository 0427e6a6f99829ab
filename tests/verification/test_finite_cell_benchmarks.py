"""Finite cells on published problems with stress concentrations: Kirsch's hole and NAFEMS LE10."""

from itertools import pairwise

import numpy as np
import pytest
from finite_cell_solids import analyse, box_regions, load_case, problem, region
from test_kirsch import kirsch_stress

from gradedesign.mechanics.finite_cell.recovery import recovered_stress
from gradedesign.mechanics.finite_cell.result import solution_of
from gradedesign.mechanics.finite_cell.stress import SolidPoints, solid_points
from gradedesign.mechanics.finite_cell.surface import element_table, locate, reference_of
from gradedesign.mechanics.material.material import Material

HALF_WIDTH = 5.0


def stress_of(result, name, points):
    """Stress in the elements that hold some points, ``(3, 3, m)``."""
    points = np.asarray(points, float).reshape(3, -1)
    element = locate(result.elements, element_table(result.elements), points)
    at = SolidPoints(
        points=points, volume=np.zeros(element.size), element=element,
        reference=reference_of(result.elements, element, points),
    )  # fmt: skip
    return recovered_stress(
        result.elements, result.space, solution_of(result, name).u, result.moduli, at
    )


def strip(name, axis, low, high, height):
    """Part of the face at `HALF_WIDTH` across an axis, between two places along the other."""
    quad = np.full((4, 3), HALF_WIDTH)
    along = 1 - axis
    quad[:, along] = (low, high, high, low)
    quad[:, 2] = (0.0, 0.0, height, height)
    return region(name, quad[[[0, 1, 2], [0, 2, 3]] if axis == 0 else [[0, 2, 1], [0, 3, 2]]])


def kirsch_plate(spacing, tension=1.0):
    """A quarter of the square with a hole of radius 1, loaded as in the infinite plate.

    Strips of a quarter of the radius carry the force and moment of the exact traction.
    """
    low, high = (0.0, 0.0, 0.0), (HALF_WIDTH, HALF_WIDTH, spacing)
    regions = {k: v for k, v in box_regions(low, high).items() if k not in {"x1", "y1"}}
    loads = []
    points, weights = np.polynomial.legendre.leggauss(6)
    ends = np.linspace(0.0, HALF_WIDTH, 21)
    for axis in range(2):
        for k, (a, b) in enumerate(pairwise(ends)):
            name = f"{'xy'[axis]}-strip-{k}"
            regions[name] = strip(name, axis, a, b, spacing)
            at = np.full((2, points.size), HALF_WIDTH)
            arm = (b - a) / 2.0 * points
            at[1 - axis] = (a + b) / 2.0 + arm
            xx, yy, xy = (tension * s for s in kirsch_stress(at))
            area = weights * (b - a) / 2.0 * spacing
            force = np.array([xx, xy]) @ area if axis == 0 else np.array([xy, yy]) @ area
            moment = -(arm * xx) @ area if axis == 0 else (arm * yy) @ area
            loads.append((name, {
                "force": [f"{float(force[0])!r} N", f"{float(force[1])!r} N", "0 N"],
                "moment": ["0 N*mm", "0 N*mm", f"{float(moment)!r} N*mm"],
            }))  # fmt: skip
    case = load_case("pull", [("x0", "x"), ("y0", "y"), ("z0", "z"), ("z1", "z")], loads)
    plate = problem(lambda p: 1.0 - np.hypot(p[0], p[1]), low, high, [case], regions)
    return analyse(plate, spacing)


def kirsch_error(result):
    """Mean error of the stress within three radii, over the tension."""
    at = solid_points(result.elements)
    near = np.hypot(at.points[0], at.points[1]) < 3.0
    points, volume = at.points[:, near], at.volume[near]
    stress = stress_of(result, "pull", points)
    exact = kirsch_stress(points)
    error = sum(np.abs(stress[i] - e) for i, e in zip([(0, 0), (1, 1), (0, 1)], exact, strict=True))
    return float(np.average(error, weights=volume))


def test_hole_in_a_plate():
    coarse, fine = kirsch_plate(0.5), kirsch_plate(0.125)
    assert kirsch_error(fine) < 2e-3  # a load 1 % wrong gives 1.3e-2
    assert np.log(kirsch_error(coarse) / kirsch_error(fine)) / np.log(4.0) > 1.8
    # Without recovery 3.049 and -1.033.
    assert stress_of(fine, "pull", (1e-6, 1 + 1e-6, 0.06))[0, 0, 0] == pytest.approx(3, rel=5e-3)
    assert stress_of(fine, "pull", (1 + 1e-6, 1e-6, 0.06))[1, 1, 0] == pytest.approx(-1, rel=0.01)


INNER, OUTER = np.array([2000.0, 1000.0]), np.array([3250.0, 2750.0])


def ellipse(axes, count=256):
    angle = np.linspace(0.0, np.pi / 2, count + 1)
    return axes * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def at_height(points, z):
    return np.column_stack([points, np.full(len(points), z)])


def quads(a, b, c, d):
    """Two triangles for each quadrilateral."""
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def le10(spacing, pressure="1 MPa"):
    """The thick plate between two ellipses; its line support is a strip of 60 mm."""
    low, high = (0.0, 0.0, 0.0), (*OUTER, 600.0)

    def field(p):
        inner, outer = (np.sqrt((p[0] / e[0]) ** 2 + (p[1] / e[1]) ** 2) for e in (INNER, OUTER))
        return np.maximum((1.0 - inner) * INNER[1], (outer - 1.0) * OUTER[1])

    rim, bore = ellipse(OUTER), ellipse(INNER)
    wall = {
        name: quads(
            at_height(rim[:-1], a), at_height(rim[1:], a), at_height(rim[1:], b),
            at_height(rim[:-1], b),
        )
        for name, a, b in (("outer", 0.0, 600.0), ("line", 270.0, 330.0))
    }  # fmt: skip
    top = quads(
        at_height(bore[:-1], 600.0), at_height(rim[:-1], 600.0), at_height(rim[1:], 600.0),
        at_height(bore[1:], 600.0),
    )  # fmt: skip
    faces = box_regions(low, high)
    regions = {"x0": faces["x0"], "y0": faces["y0"], "top": region("top", top)}
    regions |= {name: region(name, corners) for name, corners in wall.items()}
    case = load_case(
        "press",
        [("x0", "x"), ("y0", "y"), ("outer", "xy"), ("line", "z")],
        [("top", {"pressure": pressure})],
    )
    material = Material(
        name="le10", youngs_modulus=210e3, poissons_ratio=0.3, density=7.8e-9, yield_strength=1.0
    )
    return analyse(problem(field, low, high, [case], regions, material=material), spacing)


@pytest.mark.slow
def test_le10_thick_plate():
    coarse, fine = (
        float(stress_of(le10(h), "press", (2000.0 + 1e-3, 1e-3, 600.0 - 1e-3))[1, 1, 0])
        for h in (200.0, 100.0)
    )
    # At a corner of the body the value converges slowly, but with second order: -6.44 and -5.71.
    limit = fine + (fine - coarse) / 3.0
    # Published codes scatter between 5.03 and 5.94: the line support is singular.
    assert limit == pytest.approx(-5.38, rel=0.03)
    # That of the tetrahedra in test_nafems; a load 1 % wrong is seen.
    assert limit == pytest.approx(-5.461325, rel=5e-3)
