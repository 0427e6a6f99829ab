"""Solid members: shares, their price, bodies of a field, and sizing with them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_cells import plain_cells
from scipy.sparse import identity
from small_parts import SHEARED_BAR

from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop import exported_surface
from gradedesign.design.resolve.member_size import with_member_size
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.cell.family import VOID
from gradedesign.geometry.lattice.component import LATTICE, MEMBER
from gradedesign.geometry.lattice.components.members import solid_members
from gradedesign.geometry.lattice.components.void import Void
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain, phase_at
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.lattice_contour import volume_fit
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.printed_surface import printed_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.tets.tet_mesh import boundary_facets, centroids
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign.mechanics.fe.element_points import element_points
from gradedesign.mechanics.fe.facets import facet_nodes
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import PAIRS, UNIFORM
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing import size_members as members_module
from gradedesign.mechanics.sizing.filter import DensityFilter, cone_filter, cone_mean, filtered
from gradedesign.mechanics.sizing.homogenised import total_mass
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.members import (
    MemberField,
    Members,
    mean_share,
    member_filter,
    member_price,
    member_shares,
    step_slope,
    with_members,
    with_moments,
)
from gradedesign.mechanics.sizing.next_design import _cost
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    designed_mass,
    element_densities,
    element_shares,
    member_variables,
)
from gradedesign.mechanics.sizing.size import size
from gradedesign.mechanics.sizing.size_members import size_members
from gradedesign.mechanics.sizing.state import solved_state
from gradedesign.mechanics.sizing.tied_members import tied

LAW = power_law(
    "test-law", ("test",), youngs=(1.0, 2.0), strength=(0.3, 1.5), window=(0.1, 0.6),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)  # fmt: skip
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6, yield_strength=10.0
)


def members(sharpness, price=0.0, count=7, threshold=0.5):
    same = DensityFilter(factors=(identity(count, format="csr"),))
    return Members(filter=same, radius=1.0, sharpness=sharpness, price=price, threshold=threshold)


@given(st.floats(0.0, 32.0), st.floats(0.0, 10.0), st.floats(0.3, 0.7))
def test_shares_go_from_nothing_to_all_and_so_does_their_price(sharpness, price, threshold):
    b = np.linspace(0.0, 1.0, 7)
    half = member_shares(members(sharpness), b)
    assert half[3] == pytest.approx(0.5, abs=1e-12)
    found = members(sharpness, price, threshold=threshold)
    share = member_shares(found, b)
    assert share[[0, 6]] == pytest.approx([0.0, 1.0], abs=1e-12)
    assert (np.diff(share) > 0).all()
    # A higher threshold is a thinner member.
    assert ((half - share) * np.sign(threshold - 0.5) >= -1e-12).all()
    cost, slope = member_price(found, share)
    assert cost[[0, 6]] == pytest.approx([0.0, 1.0], abs=1e-12)
    assert (cost >= share - 1e-12).all()
    step = 1e-6
    inner = b[1:-1]
    few = members(sharpness, price, 5, threshold)
    rise = (member_shares(few, inner + step) - member_shares(few, inner - step)) / (2 * step)
    np.testing.assert_allclose(step_slope(few, inner, threshold), rise, rtol=1e-4, atol=1e-7)
    ahead, back = (member_price(few, share[1:-1] + s * step)[0] for s in (1, -1))
    np.testing.assert_allclose(slope[1:-1], (ahead - back) / (2 * step), rtol=1e-4, atol=1e-7)


def field_of(value, spacing=0.5, size=20.0):
    """Values of a function of points on a grid about the origin, from 0 to 1."""
    axis = np.arange(-size, size + 0.5 * spacing, spacing)
    points = np.array(np.meshgrid(axis, axis, axis, indexing="ij"))
    values = np.clip(value(points), 0.0, 1.0)
    return DensityGrid(origin=np.full(3, -size), spacing=spacing, values=values)


def ball(points, centre, radius, blur=4.0):
    return 0.5 + (radius - np.linalg.norm(points - np.reshape(centre, (3, 1, 1, 1)), axis=0)) / blur


def test_bodies_lie_where_the_field_exceeds_a_half_without_crumbs():
    """A ball of 8 mm holds its volume; one as small as nothing that is filtered is left out."""

    def value(points):
        return np.maximum(ball(points, (0, 0, 0), 8.0), ball(points, (13, 13, 13), 1.2))

    found = solid_members(field_of(value), thickness=4.0)
    assert found.count == 1
    at = np.array([[0.0, 9.0, 13.0], [0.0, 0.0, 13.0], [0.0, 0.0, 13.0]])
    inside, outside, crumb = found.distance(at, None)
    # Triangles of 0.5 mm lie 0.5^2 / (8 * 8) = 0.004 mm within the ball.
    assert (inside, outside) == pytest.approx((-8.0, 1.0), abs=0.02)
    moved = solid_members(field_of(value), thickness=4.0, offset=0.3)
    assert moved.distance(at, None) == pytest.approx(np.array([inside, outside, crumb]) - 0.3)
    assert crumb > 4.0
    assert solid_members(field_of(lambda p: ball(p, (13, 13, 13), 1.2)), thickness=4.0) is None
    assert solid_members(field_of(lambda p: 0.4 + 0.0 * p[0]), thickness=4.0) is None


def test_bodies_are_a_phase_of_their_own():
    body = solid_members(field_of(lambda p: ball(p, (0, 0, 0), 8.0)), thickness=4.0)
    domain = DesignDomain(
        distance=lambda x: np.abs(x).max(axis=0) - 15.0, lower=(-15,) * 3, upper=(15,) * 3,
        components=(body,),
    )  # fmt: skip
    points = np.array([[0.0, 14.0], [0.0, 0.0], [0.0, 0.0]])
    assert phase_at(domain, points).tolist() == [MEMBER, LATTICE]
    assert domain.facts()["solid_members"] == [{"count": 1, "least_thickness_mm": 4.0}]


def cantilever():
    """A slender beam of lattice under a transverse force, and the limit of its tip."""
    mesh = box_part_mesh((40.0, 6.0, 10.0), 2.5)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 40 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.0, 0.0, -0.05])),
        acceleration=(0.0, 0.0, 0.0),
        temperature_change=0.0,
    )
    model = homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])
    limit = DisplacementLimit(
        key=LimitKey(kind="displacement", region="tip", load_case="load"), name="tip",
        nodes=np.unique(facet_nodes(space, tip)), component=None, allowed=1.3,
    )  # fmt: skip
    filtered = cone_filter(centroids(mesh), model.volumes, 5.0)
    return SizingProblem(model=model, limits=(limit,), bounds=(0.1, 0.6), filter=filtered)


@pytest.mark.slow  # a command's run shows the same in tests/cases/test_members_run.py
def test_members_are_lighter_than_lattice_alone():
    """A flange of solid carries bending with less mass than any lattice of exponent 2."""
    problem = cantilever()
    alone = size(problem, max_iterations=30)
    assert alone.feasible

    points = centroids(problem.model.space.mesh)

    def mean(field):
        weights = problem.model.volumes
        return cone_mean(points, weights, field.radius, field.variables, points)

    def bodied(field):
        # Depth below the surface, about, over the edge of a tetrahedron.
        depth = field.radius * (mean(field) - 0.5)

        def at(offset):
            share = np.clip(0.5 + (depth + offset) / 2.5, 0.0, 1.0)
            return with_members(with_moments(problem.model), np.tile(share, 4))

        return at

    insisted = {}

    def sized(problem, start, most, insistence, near):
        insisted[problem.members.sharpness] = insistence > 1
        return size(
            problem, start=start, max_iterations=most, insistence=insistence, tolerance=near
        )

    found = size_members(problem, 3.0, None, sized, bodied)
    assert found.feasible
    # Shares that become bodies hold their limits; those on the way there need not.
    assert insisted[64.0]
    assert not insisted[2.0]
    assert found.history[-1].mass_g < 0.9 * alone.history[-1].mass_g
    # Solid lies in the flanges, not about the neutral axis.
    z = centroids(problem.model.space.mesh)[2]
    solid = mean(found.members) > 0.5
    assert np.abs(z[solid] - 5.0).mean() > 2.5


@pytest.mark.parametrize(
    ("bodies", "taken"),
    [
        ({0.5: (10.4, 0.98)}, 0.5),  # as heavy as their shares: nothing is sized again
        ({0.5: (20.0, 0.98), 0.6: (12.0, 0.98)}, 0.6),
        ({0.5: (20.0, 0.98), 0.6: (25.0, 0.98)}, 0.5),
        ({0.5: (20.0, 0.98), 0.6: (12.0, 1.2)}, 0.5),  # a lighter one that breaks a limit
    ],
)
def test_members_whose_bodies_outweigh_their_shares_are_sized_again(monkeypatch, bodies, taken):
    """From the sharpness of 8 on, carried from 0.6 on; the lighter bodies that hold are taken.

    Beside cells, which carry what thin members do not, that costs and gains nothing.
    """
    problem, asked = replace(cantilever(), bounds=(0.01, 0.04)), []
    count = problem.model.volumes.size

    def step(mass, used=0.98):
        return SizingStep(
            iteration=0, mass_g=mass, mean_density=0.2, utilisations=(used,), change=0.0
        )

    def sized(own, start, most, insistence, near):
        asked.append((own.members.sharpness, own.members.threshold))
        found = MemberField(np.zeros(count), 4.0, threshold=own.members.threshold)
        return SizingResult(
            rho=np.full(count, 0.2), variables=start, history=(step(10.0),), converged=True,
            feasible=True, members=found,
        )  # fmt: skip

    def moved(own, made, result, field, *rest):
        return field, step(*bodies[field.threshold])

    monkeypatch.setattr(members_module, "_moved", moved)
    found = size_members(problem, 3.0, None, sized, lambda _: None)
    again = [(8.0, 0.6), (16.0, 0.6), (32.0, 0.6), (64.0, 0.6)]
    assert asked == [(s, 0.5) for s in (0.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)] + (
        again if len(bodies) > 1 else []
    )
    assert found.members.threshold == taken
    assert found.history[-1].mass_g == bodies[taken][0]
    asked.clear()
    beside = size_members(cantilever(), 3.0, None, sized, lambda _: None)
    assert len(asked) == 7
    assert beside.members.threshold == 0.5
    # A later iteration of the loop goes on with members of that threshold.
    asked.clear()
    monkeypatch.setattr(members_module, "_moved", lambda *given: (given[3], step(99.0)))
    size_members(problem, 3.0, (found.variables, found.members), sized, lambda _: None)
    assert asked == [(64.0, taken)]
    # Where their surface was moved as far as it may be, places of members must change.
    asked.clear()
    bound = replace(found.members, offset=-0.75)
    size_members(problem, 3.0, (found.variables, bound), sized, lambda _: None)
    assert [sharpness for sharpness, _ in asked] == [8.0, 16.0, 32.0, 64.0]


@pytest.mark.parametrize(("sharpness", "threshold"), [(8.0, 0.5), (4.0, 0.6)])
def test_a_sharper_step_begins_with_as_much_of_members(sharpness, threshold):
    """Else those that are thin are lost with the step, and the stage begins without them."""
    problem = cantilever()
    model, points = with_moments(problem.model), centroids(problem.model.space.mesh)
    own = Members(filter=member_filter(model, 3.0), radius=3.0, sharpness=2.0)
    before = replace(problem, model=model, members=own)
    b = np.clip(0.75 - np.abs(points[2] - 5.0) / 5.0, 0.0, 1.0)
    x = np.concatenate([np.full(problem.filter.shape[1], 0.2), 0.05 + b])
    now = replace(before, members=replace(own, sharpness=sharpness, threshold=threshold))
    was, lost = (model.volumes @ mean_share(element_shares(each, x)) for each in (before, now))
    assert lost < 0.97 * was
    begun = members_module._as_much(before, now, x)
    assert model.volumes @ mean_share(element_shares(now, begun)) == pytest.approx(was, rel=1e-4)
    count = problem.filter.shape[1]
    np.testing.assert_array_equal(begun[:count], x[:count])
    raised = begun[count:] - x[count:]
    assert raised.max() - raised.min() < 1e-12
    # What carries as much already is left as it is.
    assert members_module._as_much(now, before, begun) is begun


def test_members_weigh_from_a_half_on_whatever_they_carry_from():
    """The derivative of the mass that sizing takes off, against central differences."""
    problem = cantilever()
    model = with_moments(problem.model)
    members = Members(filter=member_filter(model, 4.0), radius=4.0, sharpness=4.0, threshold=0.6)
    problem = replace(problem, model=model, members=members)
    rng = np.random.default_rng(523)
    count = model.volumes.size
    x = np.concatenate([rng.uniform(0.15, 0.5, count), rng.uniform(0.2, 0.9, count)])

    def weighed(x):
        """Mass with shares from a half on, t."""
        half = replace(members, threshold=0.5)
        return designed_mass(
            model, element_densities(problem, x), member_shares(half, member_variables(problem, x))
        )

    rho, share = element_densities(problem, x), element_shares(problem, x)
    state = solved_state(
        with_members(model, share), rho, problem.limits, share=share, lattice_alone=model
    )
    found = _cost(problem, x, state) * designed_mass(model, rho, share)
    way = rng.normal(size=x.size)
    step = 1e-5
    difference = (weighed(x + step * way) - weighed(x - step * way)) / (2 * step)
    assert found @ way == pytest.approx(difference, rel=1e-6)


def test_shares_at_gauss_points_are_those_of_the_filtered_field_there():
    """Interpolated between nodes: a cone over 5 mm bends little within tetrahedra of 2.5 mm."""
    part = cantilever().model
    points = centroids(part.space.mesh)
    smooth = 0.5 + 0.5 * np.sin(2 * np.pi * points[0] / 20.0)
    found = filtered(member_filter(part, 5.0), smooth).reshape(4, -1)
    at = element_points(part.space)
    for own, place in zip(found, np.moveaxis(at, 2, 0), strict=True):
        exact = cone_mean(points, part.volumes, 5.0, smooth, place)
        np.testing.assert_allclose(own, exact, atol=0.004)
    assert np.ptp(found, axis=0).max() > 0.02


def test_solid_at_some_gauss_points_lies_there():
    """All four together are solid; solid of one point only bends as solid at that corner does."""
    model = with_moments(cantilever().model)
    count = model.volumes.size
    whole = with_members(model, np.ones(4 * count))
    np.testing.assert_allclose(whole.solid_moments, np.tile(UNIFORM[:, None], count))
    one = with_members(model, np.repeat([1.0, 0.0, 0.0, 0.0], count))
    assert one.solid_fraction == pytest.approx(np.full(count, 0.25))
    # Of its own corner's coordinate it has the mean 0.585 (Zienkiewicz and Taylor, table 9.3).
    first = [k for k, pair in enumerate(PAIRS) if 0 in pair]
    assert one.solid_moments[first, 0].sum() == pytest.approx(0.25 * 0.58541020, rel=1e-8)


def test_mass_of_members_is_counted_once():
    """Lattice in what members leave, without what is solid in any case."""
    problem = cantilever()
    rng = np.random.default_rng(411)
    passive = np.where(rng.uniform(size=problem.model.volumes.size) < 0.2, 0.3, 0.0)
    model = with_moments(replace(problem.model, solid_fraction=passive))
    rho, share = rng.uniform(0.1, 0.6, passive.size), rng.uniform(0.1, 0.6, 4 * passive.size)
    room, mean = model.volumes * (1 - passive), mean_share(share)
    expected = MATERIAL.density * (room @ mean + (room * (1 - mean)) @ rho)
    assert designed_mass(model, rho, share) == pytest.approx(expected, rel=1e-12)
    whole = total_mass(with_members(model, share), rho)
    assert whole - designed_mass(model, rho, share) == pytest.approx(
        MATERIAL.density * (model.volumes @ passive), rel=1e-9
    )


def test_members_without_cells_are_rounded_where_they_meet_other_solids():
    """By a quarter of their thickness, where the case says nothing else."""

    def radius(**stated):
        keys = {"phases": ["solid", "void"], "least_member": "4 mm", **stated}
        part = PartSpec.model_validate({"box": ["9 mm"] * 3, "mesh_size": "2 mm"})
        spec = LatticeSpec.model_validate(keys)
        return with_member_size(spec, part, None, str).joint_radius

    assert radius() == 1.0
    assert radius(joint_radius="0.5 mm") == 0.5
    cells = {"phases": ["lattice", "solid"], "cell": "bcc", "size": "8 mm"}
    assert radius(**cells) == 0.0


@pytest.mark.parametrize(
    ("stated", "made"),
    [
        ({}, True),
        ({"grading": "thickness", "least_member": "3 mm"}, True),
        ({"phases": ["lattice"]}, False),
        ({"grading": "uniform"}, False),
        ({"method": "stress-to-density"}, False),
        ({"density": 0.3}, False),
        ({"density_map": {"formula": "0.2"}}, False),
    ],
)
def test_members_are_made_wherever_the_case_leaves_them_open(stated, made):
    keys = {"cell": "bcc", "size": "8 mm", **stated}
    assert LatticeSpec.model_validate(keys).members is made


def test_what_stands_alone_is_tied_in_by_the_shortest_way():
    """Two ends of a bar that are solid in any case, and no member between them."""
    whole = cantilever().model
    x = centroids(whole.space.mesh)[0]
    ends = np.where((x < 5.0) | (x > 35.0), 1.0, 0.0)
    part = with_moments(replace(whole, solid_fraction=ends))
    members = Members(filter=member_filter(part, 4.0), radius=4.0)
    none = MemberField(variables=np.zeros(x.size), radius=4.0)
    found = tied(part, members, none, 3.2)
    share = mean_share((filtered(members.filter, found.variables) > 0.5).astype(float))
    solid = np.maximum(share, ends) > 0.5
    # Every slice across the bar has solid in it, and the tie is no thicker than it must be.
    assert all(solid[np.abs(x - at) < 1.5].any() for at in np.arange(5.0, 35.0, 2.5))
    assert part.volumes @ share < 0.5 * part.volumes @ (1.0 - ends)
    assert found.tied
    # What is one piece stays as it is.
    assert tied(part, members, found, 3.2) is found
    assert tied(with_moments(whole), members, none, 3.2) is none


def test_a_tie_goes_round_zones_that_keep_members_out():
    whole = cantilever().model
    x, _, z = centroids(whole.space.mesh)
    ends = np.where((x < 5.0) | (x > 35.0), 1.0, 0.0)
    part = with_moments(replace(whole, solid_fraction=ends))
    none = MemberField(variables=np.zeros(x.size), radius=4.0)
    free = Members(filter=member_filter(part, 4.0), radius=4.0)
    middle = np.abs(x - 20.0) < 5.0

    def height(members):
        variables = tied(part, members, none, 3.2).variables
        return z[middle & (variables > 0.5)].mean()

    straight = height(free)
    # Within 3 mm of where it lies by itself no tie may be: it goes farther off.
    kept_out = middle & (np.abs(z - straight) < 3.0)
    beside = replace(free, allowed=np.tile(np.where(kept_out, 0.0, 1.0), 4))
    assert abs(height(beside) - straight) > 2.0
    across = replace(free, allowed=np.tile(np.where(middle, 0.0, 1.0), 4))
    with pytest.raises(LatticeError, match=r"joined to nothing.*keep members out.*phases"):
        tied(part, across, none, 3.2)


def test_the_surface_of_members_alone_holds_the_volume_of_the_body():
    """Not of every sliver of theirs in a cell that stands for none: the grid stays as it is."""
    body = solid_members(field_of(lambda p: ball(p, (0, 0, 0), 8.0)), thickness=4.0)
    part = box_surface((12.0, 12.0, 12.0))
    part = replace(part, vertices=part.vertices - 6.0)
    domain = DesignDomain(
        distance=lambda x: np.abs(x).max(axis=0) - 6.0, lower=(-6,) * 3, upper=(6,) * 3,
        components=(Void(), body),
    )  # fmt: skip
    design = LatticeDesign(
        domain=domain, cells=single(calibrate(VOID)), cell_map=lambda x: x / 4.0, cell_size=4.0,
        density=0.1,
    )  # fmt: skip
    assert volume_fit(design, 1.0, None).cell == 12.0
    made = printed_surface(design, part, 1.0, None, memory=1e9)
    # A ball of 8 mm by facets of 0.5 mm, less the six caps of 2 mm that the faces cut off.
    whole, cap = 4 / 3 * np.pi * 8.0**3, np.pi * 2.0**2 * (3 * 8.0 - 2.0) / 3
    assert enclosed_volume(made.surface) == pytest.approx(whole - 6 * cap, rel=0.01)


@pytest.mark.parametrize(("least", "left"), [(0.0, 2), (1.0, 2), (2.0, 1)])
def test_closed_pores_smaller_than_a_ball_are_filled(least, left):
    """A block with pores of 1.6 and 3 mm: what is left is what powder cannot leave."""

    def pores(u):
        x = 12.0 * u
        small = 0.8 - np.linalg.norm(x - np.reshape([2.0, 2, 2], (3, *[1] * (x.ndim - 1))), axis=0)
        large = 1.5 - np.linalg.norm(x + np.reshape([2.0, 2, 2], (3, *[1] * (x.ndim - 1))), axis=0)
        return np.maximum(small, large) / 12.0

    part = box_surface((12.0, 12.0, 12.0))
    part = replace(part, vertices=part.vertices - 6.0)
    domain = DesignDomain(
        distance=lambda x: np.abs(x).max(axis=0) - 6.0, lower=(-6,) * 3, upper=(6,) * 3
    )
    design = LatticeDesign(
        domain=domain, cells=plain_cells(pores), cell_map=lambda x: x / 12.0, cell_size=12.0,
        density=0.5,
    )  # fmt: skip
    made = printed_surface(design, part, 0.25, None, memory=1e9, least_pore=least)
    gone = 4 / 3 * np.pi * (1.5**3 + (0.8**3 if left == 2 else 0.0))
    assert made.islands.pockets == left
    assert 12.0**3 - enclosed_volume(made.surface) == pytest.approx(gone, rel=0.03)


@pytest.mark.parametrize(
    ("phases", "wall", "expected"),
    [
        ('["solid", "void"]', "", 3.0),  # members that run together enclose no void that is wanted
        ('["solid", "void"]', '[print]\nmin_wall = "4 mm"', 4.0),
        ('["lattice", "solid"]', '[print]\nmin_wall = "0.4 mm"', 0.4),
        ('["lattice", "solid"]', "", 0.0),
    ],
)
def test_closed_pores_are_filled_up_to(tmp_path, monkeypatch, phases, wall, expected):
    cell = "" if "void" in phases else 'cell = "gyroid-sheet"\nsize = "8 mm"\n'
    stated = f'phases = {phases}\nleast_member = "3 mm"\n'
    (tmp_path / "case.toml").write_text(
        SHEARED_BAR + f"[lattice]\n{cell}{stated}{wall}\n", encoding="utf-8"
    )
    asked = []
    monkeypatch.setattr(
        exported_surface, "printed_surface", lambda *_, **told: asked.append(told["least_pore"])
    )
    case = load_case(tmp_path)
    exported_surface.case_surface(case.print, case.lattice, case.run.memory, None, None, 0.5)
    assert asked == [pytest.approx(expected)]
