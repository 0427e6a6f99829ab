"""Bisection: as fine as asked, the same body, nothing torn."""

import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.long_edges import bisect_long_edges, least_count, longest_edges
from gradedesign.geometry.tets.quality import piece_labels, tet_report
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes


def test_edges_of_the_unit_tetrahedron():
    mesh = TetMesh(points=np.eye(3, 4, k=1), tets=np.arange(4)[:, None])
    assert longest_edges(mesh) == pytest.approx([np.sqrt(2.0)])


@settings(max_examples=25, deadline=None)
@given(st.floats(0.15, 1.2), st.integers(0, 2**32 - 1))
def test_no_edge_is_longer_than_asked_and_the_body_is_the_same(share, seed):
    rng = np.random.default_rng(seed)
    box = box_part_mesh((3.0, 2.0, 2.0), 1.0)
    points = box.points + rng.uniform(-0.12, 0.12, box.points.shape) + 1e3 * rng.random((3, 1))
    mesh = TetMesh(points=points, tets=box.tets)
    before = tet_report(mesh)
    assert before.inverted == 0
    longest = share * longest_edges(mesh).max()
    fine = bisect_long_edges(mesh, longest)
    after = tet_report(fine)
    assert longest_edges(fine).max() <= longest
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert (after.inverted, after.crowded, piece_labels(fine).max()) == (0, 0, 0)
    # A torn or hanging facet would add to the facets that have one tetrahedron: the area of the
    # boundary stays.
    assert boundary_area(fine) == pytest.approx(boundary_area(mesh), rel=1e-9)
    np.testing.assert_array_equal(fine.points[:, : points.shape[1]], points)
    # Rivara 1984: bisection at the longest edge does not make angles arbitrarily small.
    assert least_angle(fine) > 0.5 * least_angle(mesh)
    assert fine.tets.shape[1] >= least_count(before.volume, longest)


def least_angle(mesh):
    """Least angle between two faces of a tetrahedron, rad."""
    corners = mesh.points[:, mesh.tets]
    faces = corners[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]]
    normal = np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0], axis=0)
    normal = normal / np.linalg.norm(normal, axis=0)
    cosine = -np.einsum("xim,xjm->ijm", normal, normal)
    return np.arccos(np.clip(cosine[np.triu_indices(4, 1)], -1.0, 1.0)).min()


def boundary_area(mesh):
    facets = np.sort(
        np.concatenate(
            [mesh.tets[list(c)] for c in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))], axis=1
        ),
        axis=0,
    )
    once, counts = np.unique(facets, axis=1, return_counts=True)
    a, b, c = mesh.points[:, once[:, counts == 1]].swapaxes(0, 1)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a, axis=0), axis=0).sum()


def test_a_fine_mesh_is_returned_as_it_is():
    mesh = box_part_mesh((2.0, 1.0, 1.0), 1.0)
    assert bisect_long_edges(mesh, np.sqrt(3.0) + 1e-9) is mesh


def test_a_large_mesh_is_bisected_in_silence(caplog):
    mesh = box_part_mesh((10.0, 10.0, 10.0), 1.0)
    with caplog.at_level(logging.WARNING):
        fine = bisect_long_edges(mesh, 1.2)
    assert fine.tets.shape[1] > 2 * mesh.tets.shape[1]
    assert (signed_volumes(fine) > 0.0).all()
    assert not caplog.records


@pytest.mark.parametrize("longest", [0.0, -1.0, np.nan, np.inf])
def test_a_length_that_means_nothing_is_refused(longest):
    with pytest.raises(ValueError, match="longest edge must be positive"):
        bisect_long_edges(box_part_mesh((1.0, 1.0, 1.0), 1.0), longest)


def test_a_regular_tetrahedron_is_one():
    assert least_count(1.0 / (6.0 * np.sqrt(2.0)), 1.0) == pytest.approx(1.0)
