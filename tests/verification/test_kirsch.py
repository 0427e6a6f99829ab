"""A hole in a plate under tension, with the exact traction of the infinite plate (Kirsch)."""

import numpy as np
import pytest
from meshes import face, mapped_mesh, solve_one, stress_at_vertex, uniform

from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.recovered_stress import recovered_stress
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress_percentile import stress_percentile
from gradedesign.mechanics.fe.supports import supports_on

HALF_WIDTH, THICKNESS = 5.0, 0.2


def plate(radial, around):
    """A quarter of the square with a hole of radius 1, finer towards the hole."""

    def square_round_hole(u):
        angle = 0.5 * np.pi * u[1]
        way = np.array([np.cos(angle), np.sin(angle)])
        way[0, u[1] == 1] = 0.0
        edge = HALF_WIDTH / way.max(axis=0)
        radius = edge ** u[0]
        points = np.array([*(way * radius), THICKNESS * u[2]])
        outside = u[0] == 1
        points[:2, outside] = np.round(points[:2, outside], 12)
        return points

    return mapped_mesh((radial, around, 1), square_round_hole)


def kirsch_stress(points):
    """Plane stress components xx, yy, xy for a unit tension along x and a hole of radius 1.

    Timoshenko and Goodier, Theory of Elasticity, 3rd ed., equations (61), turned to x and y.
    """
    x, y = points[0], points[1]
    r2 = x**2 + y**2
    t = np.arctan2(y, x)
    xx = 1 - (1.5 * np.cos(2 * t) + np.cos(4 * t)) / r2 + 1.5 * np.cos(4 * t) / r2**2
    yy = -(0.5 * np.cos(2 * t) - np.cos(4 * t)) / r2 - 1.5 * np.cos(4 * t) / r2**2
    xy = -(0.5 * np.sin(2 * t) + np.sin(4 * t)) / r2 + 1.5 * np.sin(4 * t) / r2**2
    return xx, yy, xy


def test_hole_in_a_plate():
    mesh = plate(24, 64)
    space = tet_space(mesh)

    def on_x(points):
        xx, _, xy = kirsch_stress(points)
        return np.array([xx, xy, 0 * xx])

    def on_y(points):
        _, yy, xy = kirsch_stress(points)
        return np.array([xy, yy, 0 * yy])

    load = traction_force(space, face(mesh, 0, HALF_WIDTH), on_x)
    load += traction_force(space, face(mesh, 1, HALF_WIDTH), on_y)
    held = supports_on(
        space,
        [
            (face(mesh, 0, 0.0), (0.0, None, None)),
            (face(mesh, 1, 0.0), (None, 0.0, None)),
            (face(mesh, 2, 0.0), (None, None, 0.0)),
            (face(mesh, 2, THICKNESS), (None, None, 0.0)),
        ],
    )
    material = uniform(space, 1000.0, 0.3)
    u = solve_one(space, material, held, load).displacement
    # Kirsch: three times the tension beside the hole, minus the tension before it.
    beside = stress_at_vertex(space, material, u, (0.0, 1.0, 0.0))
    before = stress_at_vertex(space, material, u, (1.0, 0.0, 0.0))
    assert beside[0, 0] == pytest.approx(3.0, rel=0.01)
    assert before[1, 1] == pytest.approx(-1.0, rel=0.03)
    # The percentile by volume of the exact field, on rays from the centre with points in
    # geometric succession.
    ends = np.linspace(0.0, 1.0, 801)
    along, turn = 0.5 * (ends[1:] + ends[:-1])[:, None], 0.25 * np.pi * (ends[1:] + ends[:-1])
    edge = HALF_WIDTH / np.maximum(np.cos(turn), np.sin(turn))
    r = edge**along
    xx, yy, xy = kirsch_stress(np.array([r * np.cos(turn), r * np.sin(turn)]))
    zz = 0.3 * (xx + yy)
    exact = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)
    order = np.argsort(exact, axis=None)
    below = np.cumsum((r**2 * np.log(edge)).ravel()[order])
    recovered = recovered_stress(space, material, u)
    everywhere = np.ones((8, space.element_count))
    for percentile in (99.5, 90.0, 50.0):
        expected = np.interp(percentile / 100 * below[-1], below, exact.ravel()[order])
        found = stress_percentile(recovered, everywhere, percentile)
        assert found.value == pytest.approx(expected, rel=0.003)
        assert found.deviation < 0.02 * expected
