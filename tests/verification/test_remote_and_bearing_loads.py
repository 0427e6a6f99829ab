"""Forces at a remote point and bearing loads of pins, on tetrahedra and on finite cells."""

from dataclasses import replace

import numpy as np
import pytest
from finite_cell_solids import box_regions, load_case, newtons, region
from meshes import box_mesh, face, facets_where, mapped_mesh, mean_on, solve_one, uniform
from scipy.integrate import solve_ivp

from gradedesign.errors import CaseError, SolverError
from gradedesign.geometry.part.bore import Bore
from gradedesign.mechanics.fe.facet_quadrature import facet_points, facet_weights
from gradedesign.mechanics.fe.load_case import region_force
from gradedesign.mechanics.fe.load_schema import LoadSpec
from gradedesign.mechanics.fe.loads import resultant
from gradedesign.mechanics.fe.region_load import bearing_field, region_resultant
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.finite_cell.elements import cut_elements
from gradedesign.mechanics.finite_cell.grid import fit_grid
from gradedesign.mechanics.finite_cell.loads import case_force
from gradedesign.mechanics.finite_cell.space import brick_space, node_points
from gradedesign.mechanics.finite_cell.surface import region_points
from gradedesign.mechanics.material.material import Material

STEEL = Material(
    name="steel", youngs_modulus=200e3, poissons_ratio=0.3, density=7.8e-9, yield_strength=300.0
)
FORCE, POINT = np.array([130.0, -70.0, 410.0]), np.array([75.0, -11.0, 40.0])
RADIUS, OUTER, LENGTH = 6.0, 18.0, 10.0
CENTRE = np.array([2.0, -3.0, 0.0])
PIN = np.array([300.0, 400.0, 0.0])
#: Facets around a bore. Their middles lie within it by 1 - cos(pi / 96) = 5e-4 of the radius.
AROUND = 96


def remote_load():
    point = [f"{v!r} mm" for v in POINT.tolist()]
    return LoadSpec(region="x1", force=newtons(*FORCE.tolist()), point=point)


def pin_load(force=PIN):
    return LoadSpec(region="hole", bearing=newtons(*force.tolist()))


def wall(segments, first=0.0, last=360.0, *, slant=0.0):
    """Wall of a bore about z, normal to the axis; with a slant it is longer on the side of -x."""
    angle = np.radians(np.linspace(first, last, segments + 1))
    off = RADIUS * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    low = off + CENTRE
    high = low + np.outer(LENGTH - slant * off[:, 0], [0.0, 0.0, 1.0])
    a, b, c, d = low[:-1], low[1:], high[1:], high[:-1]
    corners = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    bore = Bore(axis=np.array([0.0, 0.0, 1.0]), point=CENTRE)
    return replace(region("hole", corners), bore=bore)


def ring(around, radial, along):
    """A ring about the bore, and the facets of its wall and of its outside."""

    def moved(u):
        radius, angle = RADIUS * (OUTER / RADIUS) ** u[0], 2.0 * np.pi * (u[1] % 1.0)
        x = np.array([radius * np.cos(angle), radius * np.sin(angle), LENGTH * u[2]])
        return x + CENTRE[:, None]

    open_ring = mapped_mesh((radial, around, along), moved)
    points, index = np.unique(open_ring.points + 0.0, axis=1, return_inverse=True)
    mesh = replace(open_ring, points=points, tets=index.ravel()[open_ring.tets])

    def at(radius):
        return facets_where(mesh, lambda x: np.abs(distance(x) - radius) < 1e-9)

    return mesh, at(RADIUS), at(OUTER)


def distance(points):
    """From the axis of the bore."""
    return np.hypot(points[0] - CENTRE[0], points[1] - CENTRE[1])


def cells_force(load, regions, field, lower, upper, spacing):
    """Nodal forces (3, N) on finite cells, and the nodes."""
    elements = cut_elements(field, fit_grid(lower, upper, spacing))
    space = brick_space(elements)
    case = load_case("loaded", [("x0", "xyz")], [("x1", {"pressure": "1 MPa"})]).model_copy(
        update={"load": (load,)}
    )
    places = {load.region: region_points(elements, field, regions[load.region])}
    force = case_force(elements, space, case, regions, places, STEEL)
    return force.T, node_points(elements, space)


def ring_cells():
    """The nodal forces of the pin on finite cells of the ring."""
    half = np.array([OUTER, OUTER, 0.0])
    return cells_force(
        pin_load(), {"hole": wall(AROUND)},
        lambda x: np.maximum(RADIUS - distance(x), distance(x) - OUTER),
        CENTRE - half, CENTRE + half + np.array([0.0, 0.0, LENGTH]), 2.9,
    )  # fmt: skip


def ring_tetrahedra():
    mesh, hole, _ = ring(AROUND, 2, 1)
    space = tet_space(mesh)
    return region_force(space, wall(AROUND), hole, pin_load()), space.nodes


def smooth_work(field, force=PIN):
    """Work of the cosine pressure of a smooth bore on a field, by the trapezoidal and Gauss' rule.

    The peak follows from the same quadrature.
    """
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4001)[:, None]
    place, weight = np.polynomial.legendre.leggauss(4)
    z, weight = 0.5 * LENGTH * (place + 1.0), 0.5 * LENGTH * weight
    turned = theta + np.arctan2(force[1], force[0]) + 0.0 * z
    normal = np.stack([np.cos(turned), np.sin(turned), 0.0 * turned])
    points = RADIUS * normal + CENTRE[:, None, None]
    points[2] += z

    def total(values):
        return np.trapezoid((values * np.cos(theta)) @ weight, theta[:, 0]) * RADIUS

    peak = np.linalg.norm(force) / total(np.cos(theta) + 0.0 * z)
    return peak * total((field(points) * normal).sum(axis=0))


def test_a_remote_force_is_a_force_and_the_moment_of_its_offset():
    """The same displacements of a cantilever as by force and moment, which are given apart."""
    size, young = (60.0, 8.0, 12.0), 70e3
    tip = box_regions((0, 0, 0), size)["x1"]
    space = tet_space(box_mesh(size, (10, 2, 3)))
    facets = face(space.mesh, 0, size[0])
    turn = np.cross(POINT - [60.0, 4.0, 6.0], FORCE)  # about the middle of the end
    apart = LoadSpec(
        region="x1",
        force=newtons(*FORCE.tolist()),
        moment=[f"{v!r} N*mm" for v in turn.tolist()],
    )
    held = supports_on(space, [(face(space.mesh, 0, 0.0), (0.0, 0.0, 0.0))])
    forces = [region_force(space, tip, facets, load) for load in (remote_load(), apart)]
    total, moment = resultant(space, forces[0], POINT)
    assert total == pytest.approx(FORCE, rel=1e-9)
    assert np.abs(moment).max() < 1e-9 * np.linalg.norm(turn)
    one, two = (
        solve_one(space, uniform(space, young, 0.0), held, force).displacement for force in forces
    )
    assert np.abs(one - two).max() < 1e-9 * np.abs(two).max()
    # Timoshenko: w = F l^3 / 3 E I - M l^2 / 2 E I + F l / (5/6 G A), and M turns x towards -z.
    inertia, shear = 8.0 * 12.0**3 / 12.0, 0.5 * young * 8.0 * 12.0
    bent = FORCE[2] * 60.0**3 / 3.0 - turn[1] * 60.0**2 / 2.0
    expected = bent / (young * inertia) + FORCE[2] * 60.0 / (5 / 6 * shear)
    # Three quadratic elements over the depth: within 0.3 % of the beam.
    assert mean_on(space, facets, one)[2] == pytest.approx(expected, rel=3e-3)


def test_a_remote_force_arrives_on_finite_cells():
    lower, upper = np.zeros(3), np.array([12.0, 8.0, 10.0])

    def field(x):
        shape = (3, *[1] * (x.ndim - 1))
        return np.maximum(-x, x - upper.reshape(shape)).max(axis=0)

    force, nodes = cells_force(remote_load(), box_regions(lower, upper), field, lower, upper, 2.3)
    assert force.sum(axis=1) == pytest.approx(FORCE, rel=1e-9)
    about = np.cross(nodes - POINT[:, None], force, axis=0).sum(axis=1)
    assert np.abs(about).max() < 1e-9 * np.linalg.norm(FORCE) * np.linalg.norm(POINT)


@pytest.mark.parametrize("discretised", [ring_tetrahedra, ring_cells])
def test_a_bearing_load_is_the_cosine_pressure_of_a_pin(discretised):
    """Resultant to rounding; work on quadratic fields against quadrature on the smooth bore."""
    force, nodes = discretised()
    size = np.linalg.norm(PIN)
    assert np.abs(force.sum(axis=1) - PIN).max() < 1e-9 * size
    # A pin presses through the middle of its bore.
    arm = nodes - (CENTRE + np.array([0.0, 0.0, 0.5 * LENGTH]))[:, None]
    assert np.abs(np.cross(arm, force, axis=0).sum(axis=1)).max() < 1e-9 * size * RADIUS

    def squares(x):
        a, b = x[0] - CENTRE[0], x[1] - CENTRE[1]
        return np.stack([a * a + a * x[2], b * b + a * b, 0.0 * a])

    # Facets of 3.75 degrees take 5e-4 of the radius at most, and as much of the square by half.
    expected = smooth_work(squares)
    assert float((squares(nodes) * force).sum()) == pytest.approx(expected, rel=1e-3)


def test_the_peak_of_a_bearing_load_is_that_of_the_textbook():
    """p0 = 2 F / (pi r l) ahead of the pin, nothing behind it and beside it."""
    hole = wall(AROUND)
    points = facet_points(hole.corners.T)
    weights = facet_weights(np.full(len(hole.corners), hole.area / len(hole.corners)))
    traction = bearing_field(hole, tuple(PIN), points, weights)
    ahead = PIN / 500.0
    aside = np.cross([0.0, 0.0, 1.0], ahead)
    ways = (ahead, (ahead + aside) / 2**0.5, aside, -ahead)
    at = CENTRE[:, None] + RADIUS * np.stack(ways, axis=1)
    pressure = np.linalg.norm(traction(at), axis=0)
    textbook = 2.0 * 500.0 / (np.pi * RADIUS * LENGTH)
    # Areas of facets of 3.75 degrees are 2e-4 less than the smooth wall's.
    assert pressure[0] == pytest.approx(textbook, rel=5e-4)
    assert pressure[1] == pytest.approx(textbook / 2**0.5, rel=5e-4)
    assert np.abs(pressure[2:]).max() < 1e-3 * textbook


def first_harmonic(push, first, shear):
    """Mean displacement along x of the inner edge of a ring held outside, plane strain, mm.

    Of the traction ``push cos(theta)`` on the inner edge: the other harmonics of a bearing
    pressure leave the edge's mean where it is. Radial equations of u_r = f cos, u_theta = g sin,
    by Runge and Kutta's method from two starts that leave the traction as it is.
    """

    def rates(r, y):
        f, g, pull, slide = y
        hoop = (f + g) / r
        slope = (pull - first * hoop) / (first + 2.0 * shear)
        around = (first + 2.0 * shear) * hoop + first * slope
        return [
            slope,
            slide / shear + hoop,
            -(pull - around + slide) / r,
            -(2.0 * slide - around) / r,
        ]

    def outside(f, g, pull):
        end = solve_ivp(rates, (RADIUS, OUTER), [f, g, pull, 0.0], rtol=1e-10, atol=1e-14)
        return end.y[:2, -1]

    start = np.linalg.solve(
        np.stack([outside(1.0, 0.0, 0.0), outside(0.0, 1.0, 0.0)], axis=1),
        -outside(0.0, 0.0, -push),
    )
    return 0.5 * (start[0] - start[1])


def test_a_pin_moves_its_bore_as_elasticity_says():
    mesh, hole, outside = ring(48, 6, 1)
    space = tet_space(mesh)
    ends = np.concatenate([face(mesh, 2, 0.0), face(mesh, 2, LENGTH)])
    held = supports_on(space, [(outside, (0.0, 0.0, 0.0)), (ends, (None, None, 0.0))])
    young, nu = 70e3, 0.3
    force = region_force(space, wall(48), hole, pin_load())
    u = solve_one(space, uniform(space, young, nu), held, force).displacement
    shear = 0.5 * young / (1.0 + nu)
    # Half of the peak is the first harmonic of a cosine over half of the turn.
    push = np.linalg.norm(PIN) / (np.pi * RADIUS * LENGTH)
    along = first_harmonic(push, 2.0 * shear * nu / (1.0 - 2.0 * nu), shear)
    # Straight edges of 7.5 degrees: areas and radii within 0.3 %.
    assert mean_on(space, hole, u) == pytest.approx(along * PIN / 500.0, rel=3e-3, abs=3e-3 * along)


def test_a_bearing_load_on_a_slanted_bore_has_its_resultant():
    """Where the wall is longer on one side, the peak turns so that the force is the stated one."""
    slanted = wall(AROUND, slant=0.4)
    force, moment = region_resultant(slanted, pin_load())
    assert force == pytest.approx(PIN, rel=1e-12)
    # No friction: nothing turns about the axis of the bore, and the load acts square to it.
    arm = slanted.centroid - CENTRE
    assert abs((moment + np.cross(arm, force))[2]) < 1e-9 * 500.0 * RADIUS
    # Half of the wall is enough where it is the half that the pin presses on.
    ahead = np.degrees(np.arctan2(PIN[1], PIN[0]))
    half = region_resultant(wall(48, ahead - 90.0, ahead + 90.0), pin_load())
    assert half[0] == pytest.approx(PIN, rel=1e-12)


@pytest.mark.parametrize(
    ("where", "force", "words"),
    [
        (replace(wall(24), bore=None), PIN, ["'hole'", "not the wall of one bore", "cylinder"]),
        (wall(24), np.array([0.0, 0.0, 5e3]), ["5000 of 5000 N along the axis", "(0, 0, 1)"]),
        (wall(24), np.array([300.0, 0.0, 20.0]), ["20 of 300.7 N along the axis"]),
        (wall(24, -90.0, 90.0), -PIN, ["less than the half", "-90 to 90"]),
        (wall(24, 53.0, 143.0), PIN, ["less than the half", "from -90 to -0.1301 degrees"]),
        (wall(24, -33.0, 113.0), PIN, ["less than the half", "from 59.87 to 90 degrees"]),
    ],
)
def test_what_carries_no_bearing_load_is_refused(where, force, words):
    with pytest.raises(CaseError) as refused:
        region_resultant(where, pin_load(force))
    assert all(word in str(refused.value) for word in words), refused.value


def test_a_body_without_the_pressed_wall_is_refused():
    mesh, hole, _ = ring(24, 1, 1)
    behind = hole[(mesh.points[:, hole].mean(axis=2).T - CENTRE) @ PIN < 0.0]
    with pytest.raises(SolverError, match="cannot carry a bearing load"):
        region_force(tet_space(mesh), wall(24), behind, pin_load())
