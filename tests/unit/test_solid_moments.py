"""Moments of skins and passive regions in tetrahedra."""

from math import factorial

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gradedesign.geometry.lattice.components.drain import Drain
from gradedesign.geometry.lattice.components.joint import interior_points
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain, phase_at
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe.stiffness import PAIRS, UNIFORM, mean_of
from gradedesign.mechanics.sizing._solid_moment_kernels import negative_moments as kernel
from gradedesign.mechanics.sizing.solid_moments import (
    DIVISIONS,
    _divided,
    _solid_value,
    solid_fraction,
    solid_moments,
)

SIZE = (12.0, 8.0, 8.0)
CORNERS = np.eye(4)
ONE = np.arange(4)[None]


#: Solid to 3 mm from x = 0.
KEPT_END = PassiveRegion(to_place=lambda x: np.abs(x[0]), margin=3.0)


def domain(**changes):
    stated = {
        "distance": surface_distance(box_surface(SIZE)), "lower": (0, 0, 0), "upper": SIZE,
        "components": (Skin(thickness=1.0), KEPT_END),
    }  # fmt: skip
    return DesignDomain(**(stated | changes))


def beta(a, b, upto):
    """Integral of ``x^a (1 - x)^b`` from 0 to a bound, for whole exponents."""
    terms = [
        (-1) ** k * factorial(b) / (factorial(k) * factorial(b - k)) * upto ** (a + k + 1)
        / (a + k + 1)
        for k in range(b + 1)
    ]  # fmt: skip
    return sum(terms)


def negative_moments(values, nodes, pieces):
    moments = np.zeros((len(values), 10))
    kernel(0, len(values), values, nodes, pieces, moments)
    return moments


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 2, 0), (1, 3, 0, 2)])
@pytest.mark.parametrize("share", [0.1, 0.6, 0.95])
def test_a_layer_along_a_face_or_at_a_corner(share, order):
    """A coordinate c has the density 3 (1 - c)^2 in a tetrahedron; below a height and above it."""
    values = CORNERS[order[0]] - share
    below = negative_moments(values[None], CORNERS, ONE)[0]
    above = negative_moments(-values[None], CORNERS, ONE)[0]
    square = PAIRS.index((order[0],) * 2)
    assert mean_of(below) == pytest.approx(1 - (1 - share) ** 3, rel=1e-12)
    assert below[square] == pytest.approx(3 * beta(2, 2, share), rel=1e-12)
    np.testing.assert_allclose(below + above, UNIFORM, atol=1e-14)


@pytest.mark.parametrize("share", [0.1, 0.6])
def test_a_wedge_along_an_edge(share):
    """The sum s of two coordinates has the density 6 s (1 - s); less of it than a share."""
    wedge = negative_moments((CORNERS[0] + CORNERS[2] - share)[None], CORNERS, ONE)[0]
    first = PAIRS.index((0, 0)), PAIRS.index((2, 2)), PAIRS.index((0, 2))
    assert mean_of(wedge) == pytest.approx(6 * beta(1, 1, share), rel=1e-12)
    sums = wedge[first[0]] + wedge[first[1]] + 2 * wedge[first[2]]
    assert sums == pytest.approx(6 * beta(3, 1, share), rel=1e-12)


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4), st.integers(1, 4))
def test_pieces_of_a_linear_function_are_its_whole(values, divisions):
    """Also where it is 0 at corners, along edges or everywhere; not where rounding is its size."""
    assume(not 0 < np.abs(values).max() < 1e-3)
    nodes, pieces = _divided(divisions)
    assert len(pieces) == divisions**3
    whole = negative_moments(np.array([values]), CORNERS, ONE)
    divided = negative_moments((nodes @ values)[None], nodes, pieces)
    np.testing.assert_allclose(divided, whole, atol=1e-12)
    assert (whole >= -1e-15).all()


@pytest.mark.parametrize("size", [1.3, 4.0, 8.0])
def test_solid_volumes_do_not_depend_on_the_size_of_the_tetrahedra(size):
    """12 x 8 x 8 mm less the lattice of 8 x 6 x 6 mm, by geometry.

    The lattice loses a chamfer along its 80 mm of edges, where distances have a kink. Its legs are
    up to a piece h long, half of it in the mean: h^2 / 8 across.
    """
    mesh = box_part_mesh(SIZE, size)
    share = solid_fraction(solid_moments(domain(), mesh))
    assert share.min() >= 0
    assert share.max() <= 1
    exact = 12 * 64 - 8 * 36
    found = signed_volumes(mesh) @ share
    assert 0 <= found - exact <= 80 * (size / DIVISIONS) ** 2 / 8


def test_a_thin_skin_of_large_tetrahedra_is_exact():
    """0.1 mm below the two faces across x of 12 mm; points of a few layers see none or a lot."""
    faces = Skin(thickness=0.1, faces=lambda x: np.minimum(x[0], 12.0 - x[0]))
    mesh = box_part_mesh(SIZE, 8.0)
    moments = solid_moments(domain(components=(faces,)), mesh)
    volume = signed_volumes(mesh) @ solid_fraction(moments)
    assert volume == pytest.approx(2 * 0.1 * 64, rel=1e-9)


def test_moments_put_the_solid_where_it_is():
    """The skin's second moment about the middle is that of the layer itself."""
    faces = Skin(thickness=0.5, faces=lambda x: np.minimum(x[2], 8.0 - x[2]))
    mesh = box_part_mesh(SIZE, 8.0)
    moments = solid_moments(domain(components=(faces,)), mesh)
    z = mesh.points[2][mesh.tets] - 4.0
    times = [1 if s == t else 2 for s, t in PAIRS]
    second = sum(k * m * z[s] * z[t] for k, m, (s, t) in zip(times, moments, PAIRS, strict=True))
    exact = 12 * 8 * 2 * (4.0**3 - 3.5**3) / 3
    assert signed_volumes(mesh) @ second == pytest.approx(exact, rel=1e-9)


def test_drains_open_the_solid_and_nothing_is_solid_without_layers():
    mesh = box_part_mesh(SIZE, 2.0)
    drained = domain(
        components=(
            *domain().components,
            Drain(mouth=np.array([6.0, 4, 0]), inward=np.array([0.0, 0, 1]), radius=2.0, depth=8.0),
        )
    )
    lost = signed_volumes(mesh) @ (
        solid_fraction(solid_moments(domain(), mesh)) - solid_fraction(solid_moments(drained, mesh))
    )
    # Two discs of 4 mm through 1 mm of skin. Chords of at most the diagonal c of pieces of half a
    # millimetre leave c^2 / (6 r^2) of a disc: 0.75 / 24.
    assert lost == pytest.approx(2 * np.pi * 4.0, rel=0.75 / 24)
    assert not solid_moments(domain(components=()), mesh).any()


def test_value_and_phase_say_the_same():
    points = np.random.default_rng(3).uniform(0, 1, (3, 4000)) * np.array(SIZE)[:, None]
    skins = (Skin(thickness=1.0), Skin(thickness=3.0, faces=lambda x: x[1]))
    for each in (domain(), domain(components=(*skins, KEPT_END)), domain(components=skins)):
        values = _solid_value(each, each.solids, points)
        np.testing.assert_array_equal(values < 0, phase_at(each, points) != 0)


def test_one_tetrahedron_by_many_points():
    """A slanting layer through a tetrahedron of no symmetry, thicker than its pieces are.

    Exact then; the count at 4e5 points errs by 0.1 % (share) and 0.3 % (least moment), one sigma.
    """
    corners = np.array([[0.0, 3, 1, 0.5], [0, 0.2, 2, 0.7], [0, 0.1, 0.3, 4]])
    mesh = TetMesh(points=corners, tets=np.arange(4)[:, None])
    region = PassiveRegion(to_place=lambda x: np.abs(x[0] + x[1] - 1.4) / np.sqrt(2), margin=0.7)
    moments = solid_moments(domain(components=(region,)), mesh)[:, 0]
    weights = np.random.default_rng(9).dirichlet(np.ones(4), 400_000)
    inside = region.to_place(corners @ weights.T) < region.margin
    assert 0.3 < inside.mean() < 0.97
    counted = [(weights[:, s] * weights[:, t] * inside).mean() for s, t in PAIRS]
    np.testing.assert_allclose(moments, counted, rtol=0.01)
    assert mean_of(moments) == pytest.approx(inside.mean(), rel=0.004)


def test_points_of_tetrahedra_lie_in_no_layers():
    """A layer of 0.1 mm below two faces of 12 mm is 1/60 of their volume.

    Of 20 points a tetrahedron in layers along its faces none or half lie in it. 20 random points in
    each would err by 3 % of it, one sigma; evenly spread ones by less.
    """
    mesh = box_part_mesh(SIZE, 1.0)
    points = interior_points(mesh)
    assert points.shape == (3, 20, mesh.tets.shape[1])
    count = points[0].size
    sigma = np.sqrt(1 / 60 * 59 / 60 / count)
    found = (np.minimum(points[0], 12.0 - points[0]) < 0.1).mean()
    assert found == pytest.approx(1 / 60, abs=3 * sigma)
    middle = mesh.points[:, mesh.tets].mean(axis=1)
    assert np.abs(points.mean(axis=1) - middle).max() < 0.3
