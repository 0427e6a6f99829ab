"""Stress recovered to the surface, and its percentile where it is judged."""

import numpy as np
import pytest

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.mechanics.fe.recovered_stress import at_nodes, recovered_stress
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.fe.stress import element_stress, nodal_average, von_mises
from gradedesign.mechanics.fe.stress_percentile import EIGHTHS, judged_shares, stress_percentile

LENGTH, DEPTH = 4.0, 2.0
YOUNG, CURVATURE = 1000.0, 0.01


def everywhere(space):
    return np.ones((8, space.element_count))


def bent_bar(nu=0.3, size=0.6, shift=0.0):
    """A bar in pure bending about y, whose displacements are quadratic; perhaps not regular."""
    mesh = box_part_mesh((LENGTH, 1.0, DEPTH), size)
    points = np.array(mesh.points)
    inner = ((points > 1e-9) & (points < np.array([[LENGTH], [1.0], [DEPTH]]) - 1e-9)).all(axis=0)
    points[:, inner] += shift * np.random.default_rng(17).uniform(-1, 1, (3, inner.sum()))
    space = tet_space(TetMesh(points=points, tets=mesh.tets), 2)
    x, y, z = space.nodes[0], space.nodes[1] - 0.5, space.nodes[2] - DEPTH / 2
    half = CURVATURE / 2
    u = np.array(
        [
            CURVATURE * x * z,
            -nu * CURVATURE * y * z,
            -half * (x**2 + nu * (z**2 - y**2)),
        ]
    )
    stiffness = IsotropicStiffness(E=np.full(space.element_count, YOUNG), nu=nu)
    return space, stiffness, u


@pytest.mark.parametrize("shift", [0.0, 0.08])
def test_a_linear_stress_and_its_percentile_are_exact_to_the_surface(shift):
    space, stiffness, u = bent_bar(shift=shift)
    stress = recovered_stress(space, stiffness, u)
    expected = np.zeros((3, 3, space.node_count))
    expected[0, 0] = YOUNG * CURVATURE * (space.nodes[2] - DEPTH / 2)
    assert stress.nodal == pytest.approx(expected, abs=1e-9)
    most = YOUNG * CURVATURE * DEPTH / 2
    for percentile in (50.0, 90.0, 99.5, 100.0):
        found = stress_percentile(stress, everywhere(space), percentile)
        # Every share of the volume is the same share of the depth.
        assert found.value == pytest.approx(percentile / 100 * most, rel=1e-6)
        assert found.largest == pytest.approx(most)
        assert found.deviation < 1e-9 * most


def test_eighths_fill_their_element():
    corners = np.array([[0.0, 0, 0], [2, 0.1, 0], [0.3, 1.7, 0.2], [0.1, 0.4, 1.5]]).T
    nodes = at_nodes(corners)
    parts = nodes[:, EIGHTHS]
    edges = parts[:, :, 1:] - parts[:, :, :1]
    volumes = np.linalg.det(edges.transpose(1, 0, 2)) / 6.0
    whole = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert np.abs(volumes) == pytest.approx(np.full(8, abs(whole) / 8.0))
    # None over another: their centroids and those of the element agree, and so do second moments.
    moment = sum(np.outer(p.sum(1), p.sum(1)) + p @ p.T for p in parts.transpose(1, 0, 2)) / 160.0
    total = np.outer(corners.sum(1), corners.sum(1)) + corners @ corners.T
    assert moment == pytest.approx(total / 20.0)


def test_averages_at_all_nodes_are_the_slow_ones():
    space, _, _ = bent_bar(shift=0.08)
    rng = np.random.default_rng(5)
    values = rng.normal(size=(2, space.element_count, 10))
    corners = space.mesh.points[:, space.mesh.tets]
    volumes = np.abs(np.linalg.det((corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1))) / 6
    found = nodal_average(space, values)
    for node in (0, 7, space.node_count // 2, space.node_count - 1):
        local, element = np.nonzero(space.elements == node)
        expected = values[:, element, local] @ volumes[element] / volumes[element].sum()
        assert found[:, node] == pytest.approx(expected, rel=1e-12)
    with pytest.raises(ValueError, match="do not fit"):
        nodal_average(space, values[..., :7])


def test_the_zone_of_exclusion_cuts_elements():
    space, stiffness, u = bent_bar()
    for cut in (0.31, 1.0, 2.77):
        shares = judged_shares(space, lambda p, cut=cut: p[0] > cut)
        # Samples lie in planes an eighth of an element apart, 0.57 mm / 8.
        assert shares.mean() == pytest.approx(1 - cut / LENGTH, abs=0.57 / 16 / LENGTH)
    stress = recovered_stress(space, stiffness, u)
    assert stress_percentile(stress, 0 * everywhere(space), 99.5) is None


def test_a_stress_within_the_zone_does_not_count():
    space, stiffness, u = bent_bar()
    stress = recovered_stress(space, stiffness, u)
    shares = judged_shares(space, lambda p: np.abs(p[2] - DEPTH / 2) < 0.5)
    found = stress_percentile(stress, shares, 100.0)
    assert found.value == pytest.approx(0.5 * YOUNG * CURVATURE, rel=0.15)
    assert found.largest < 0.6 * YOUNG * CURVATURE


def test_the_deviation_is_that_of_the_elements_where_the_percentile_is_reached():
    space, stiffness, u = bent_bar()
    rng = np.random.default_rng(23)
    u = u + 1e-4 * rng.normal(size=u.shape)
    stress = recovered_stress(space, stiffness, u)
    found = stress_percentile(stress, everywhere(space), 90.0)
    raw = at_nodes(element_stress(space, stiffness, u, at="vertices"))
    at = von_mises(stress.nodal)
    total = weight = 0.0
    for element in range(space.element_count):
        nodes = space.elements[:, element]
        gap = von_mises(raw[:, :, element] - stress.nodal[:, :, nodes])
        for eighth in EIGHTHS:
            if at[nodes[eighth]].max() >= found.value:
                total += gap[eighth].mean()
                weight += 1
    # Bricks of one size: every element has the same volume.
    assert found.deviation == pytest.approx(total / weight)
    assert found.deviation > 0.01 * found.value


def test_free_thermal_strain_leaves_no_stress():
    space, stiffness, _ = bent_bar()
    grown = recovered_stress(space, stiffness, 2e-3 * space.nodes, thermal_strain=2e-3)
    assert np.abs(grown.nodal).max() < 1e-9 * YOUNG
    held = recovered_stress(space, stiffness, 0 * space.nodes, thermal_strain=2e-3)
    # Held on all sides: -E alpha dT / (1 - 2 nu) in every direction.
    pressure = -YOUNG * 2e-3 / (1 - 2 * 0.3)
    assert held.nodal[0, 0] == pytest.approx(np.full(space.node_count, pressure))
