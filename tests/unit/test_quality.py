"""Mesh quality gates against closed forms and a slow, plain implementation."""

import numpy as np
import pytest

from gradedesign.errors import MeshError
from gradedesign.geometry.contour.islands import largest_components
from gradedesign.geometry.tets.quality import piece_labels, require_sound, tet_report
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, unbalanced_edge_count

REGULAR = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1.0]]).T
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]).T


def one(points, order=(0, 1, 2, 3)):
    return TetMesh(points=points, tets=np.array(order)[:, None])


def kuhn(shape):
    """Cubes of edge 1, six tetrahedra each."""
    from itertools import permutations

    node = np.arange(np.prod(np.add(shape, 1))).reshape(np.add(shape, 1))
    points = np.indices(node.shape).reshape(3, -1).astype(float)
    tets = []
    for order in permutations(range(3)):
        corner = np.zeros(3, dtype=int)
        path = [corner.copy()]
        for axis in order:
            corner[axis] += 1
            path.append(corner.copy())
        ids = [node[tuple(slice(c[i], c[i] + shape[i]) for i in range(3))].ravel() for c in path]
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        tets.append(np.array(ids if even else [ids[1], ids[0], *ids[2:]]))
    return TetMesh(points=points, tets=np.concatenate(tets, axis=1))


def joined(*meshes):
    """Side by side, without merging points."""
    offsets = np.cumsum([0, *(m.points.shape[1] for m in meshes)])
    return TetMesh(
        points=np.concatenate([m.points for m in meshes], axis=1),
        tets=np.concatenate([m.tets + o for m, o in zip(meshes, offsets, strict=False)], axis=1),
    )


def slow_labels(mesh):
    """Pieces by repeated spreading over shared facets: the oracle."""
    facets = [{frozenset(np.delete(tet, k)) for k in range(4)} for tet in mesh.tets.T]
    labels = np.full(len(facets), -1)
    for seed in range(len(facets)):
        if labels[seed] >= 0:
            continue
        label, front = labels.max() + 1, [seed]
        labels[seed] = label
        while front:
            here = front.pop()
            for other in range(len(facets)):
                if labels[other] < 0 and facets[here] & facets[other]:
                    labels[other] = label
                    front.append(other)
    return labels


def test_volumes_of_known_tetrahedra():
    assert tet_report(one(REGULAR)).volume == pytest.approx(8 / 3)  # (2 sqrt 2)^3 / (6 sqrt 2)
    assert tet_report(one(CORNER)).volume == pytest.approx(1 / 6)


def test_a_flat_tetrahedron_counts_as_inverted():
    flat = CORNER.copy()
    flat[:, 3] = [0.5, 0.5, 0.0]
    assert tet_report(one(flat)).inverted == 1


def test_labels_agree_with_the_slow_version():
    rng = np.random.default_rng(77)
    mesh = kuhn((4, 3, 3))
    chosen = rng.permutation(mesh.tets.shape[1])[:70]
    part = TetMesh(points=mesh.points, tets=mesh.tets[:, chosen])
    labels = piece_labels(part)
    np.testing.assert_array_equal(labels, slow_labels(part))
    assert labels.max() > 5  # otherwise the case says little


def test_contact_in_an_edge_or_a_vertex_is_no_connection():
    mesh = kuhn((2, 2, 2))
    cube = np.floor(mesh.points[:, mesh.tets].mean(axis=1)).astype(int)
    for second in ([1, 1, 0], [1, 1, 1]):
        keep = (cube == 0).all(axis=0) | (cube == np.array(second)[:, None]).all(axis=0)
        assert piece_labels(TetMesh(points=mesh.points, tets=mesh.tets[:, keep])).max() == 1
    keep = (cube == 0).all(axis=0) | (cube == np.array([1, 0, 0])[:, None]).all(axis=0)
    assert piece_labels(TetMesh(points=mesh.points, tets=mesh.tets[:, keep])).max() == 0


def test_a_sound_mesh_is_counted():
    report = require_sound(
        kuhn((3, 4, 5)), subject="the box", expected_volume=60.0, volume_tolerance=1e-12
    )
    assert (report.count, report.inverted, report.crowded) == (360, 0, 0)
    assert report.volume == pytest.approx(60.0, rel=1e-12)  # 3 x 4 x 5


def test_the_largest_piece_is_kept_by_volume_not_by_count():
    small = kuhn((2, 2, 2))
    small = TetMesh(points=0.1 * small.points, tets=small.tets)
    large = TetMesh(points=kuhn((1, 1, 1)).points + 5.0, tets=kuhn((1, 1, 1)).tets)
    kept, dropped, _ = largest_components(joined(small, large), keep=1, max_share=1.0)
    assert dropped == 1
    assert kept.tets.shape[1] == 6
    assert kept.points.shape[1] == 8
    assert signed_volumes(kept).sum() == pytest.approx(1.0, rel=1e-12)


def test_every_fault_is_named_with_its_number():
    box = kuhn((2, 1, 1))
    tets = box.tets.copy()
    tets[:2, 0] = tets[1::-1, 0]
    with pytest.raises(MeshError, match="the box is refused: 1 of 12 tetrahedra have no positive"):
        require_sound(TetMesh(points=box.points, tets=tets), subject="the box")
    double = TetMesh(points=box.points, tets=np.concatenate([box.tets, box.tets], axis=1))
    with pytest.raises(MeshError, match="facets have more than two tetrahedra"):
        require_sound(double, subject="the box")
    with pytest.raises(MeshError, match=r"2 mm\^3, expected 2\.03 mm\^3 within 0.01"):
        require_sound(box, subject="the box", expected_volume=2.03)
    require_sound(box, subject="the box", expected_volume=2.019)
    with pytest.raises(MeshError, match=r"facets have more .*; and its volume"):
        require_sound(double, subject="the box", expected_volume=3.0)


def test_no_tetrahedra_is_an_error():
    with pytest.raises(MeshError, match="no tetrahedra"):
        require_sound(TetMesh(points=CORNER, tets=np.zeros((4, 0), dtype=int)), subject="nothing")


def test_unbalanced_edges_of_open_closed_and_touching_shells():
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    closed = SurfaceMesh(vertices=CORNER.T, faces=faces)
    assert unbalanced_edge_count(closed) == 0
    assert unbalanced_edge_count(SurfaceMesh(vertices=CORNER.T, faces=faces[1:])) == 3
    flipped = np.concatenate([faces[:1, ::-1], faces[1:]])
    assert unbalanced_edge_count(SurfaceMesh(vertices=CORNER.T, faces=flipped)) == 3
    # A second tetrahedron on the other side of edge 0-1: that edge has four triangles.
    points = np.concatenate([CORNER.T, [[0.2, -1, 0], [0.2, 0, -1]]])
    other = np.array([0, 1, 4, 5])[faces]
    volume = np.linalg.det(points[[1, 4, 5]] - points[0])
    other = other if volume > 0 else other[:, ::-1]
    touching = SurfaceMesh(vertices=points, faces=np.concatenate([faces, other]))
    assert unbalanced_edge_count(touching) == 0
