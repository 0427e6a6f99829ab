"""Loose solids go, voids of the main solid stay, large losses are refused."""

import numpy as np
import pytest

from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.islands import largest_components, remove_islands
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    open_edge_count,
)

H = 0.1


def ball(centre, r):
    return lambda p: np.linalg.norm(p - np.reshape(centre, (3, *[1] * (p.ndim - 1))), axis=0) - r


def surface_of(*solids):
    """Union of hollow balls ``(centre, outer radius, inner radius)``."""

    def field(p):
        return np.min(
            [
                np.maximum(ball(c, r)(p), -ball(c, hole)(p)) if hole else ball(c, r)(p)
                for c, r, hole in solids
            ],
            axis=0,
        )

    return extract_surface(field, [-2.5] * 3, [2.5] * 3, H)


MAIN = ((0, 0, 0), 1.5, 0.8)  # hollow
INNER = ((0.1, 0, 0), 0.3, None)  # floats in the hollow
OUTER = ((2, 2, 2), 0.3, 0.2)  # hollow and loose


def test_loose_solids_go_and_the_pocket_stays():
    surface, found = remove_islands(surface_of(MAIN, INNER, OUTER))
    assert (found.dropped, found.pockets) == (2, 1)
    alone = surface_of(MAIN)
    assert enclosed_volume(surface) == pytest.approx(enclosed_volume(alone), rel=1e-12)
    assert len(surface.faces) == len(alone.faces)
    assert open_edge_count(surface) == 0
    gone = 4 / 3 * np.pi * (0.3**3 + 0.3**3 - 0.2**3)
    assert found.dropped_volume == pytest.approx(gone, rel=0.06)
    assert found.dropped_share == pytest.approx(gone / (gone + enclosed_volume(alone)), rel=0.06)
    assert found.pocket_volume == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.02)


def test_filled_pockets_hide_nothing_of_what_is_dropped():
    loose = surface_of(MAIN, ((2, 2, 2), 0.3, None))
    plain = remove_islands(loose)[1]
    filled = remove_islands(loose, least_pocket=3.0)[1]  # the hollow holds 2.1 mm^3
    assert (plain.pockets, filled.pockets) == (1, 0)
    assert (plain.filled_words, filled.filled) == ((), 1)
    hollow = 4 / 3 * np.pi * 0.8**3
    assert filled.filled_volume == pytest.approx(hollow, rel=0.02)
    share = hollow / (4 / 3 * np.pi * 1.5**3)  # of the ball, which is full now
    assert filled.filled_share == pytest.approx(share, rel=0.03)
    (words,) = filled.filled_words
    assert words.startswith("1 closed pore was filled, too small to be drained: 2.1")
    assert plain.dropped_volume > 0.0
    assert filled.dropped_volume == pytest.approx(plain.dropped_volume, rel=1e-12)


def test_one_solid_is_returned_as_it_is():
    surface = surface_of(((0, 0, 0), 1.0, None))
    same, found = remove_islands(surface)
    assert same is surface
    assert (found.dropped, found.pockets, found.dropped_volume) == (0, 0, 0.0)


def test_two_bodies_are_kept_when_asked():
    surface = surface_of(((-1.2, 0, 0), 1.0, None), ((1.2, 0, 0), 0.8, None))
    same, found = remove_islands(surface, keep=2)
    assert same is surface
    assert found.dropped == 0
    with pytest.raises(LatticeError, match=r"1 disconnected components hold 33\.8 %"):
        remove_islands(surface)


def test_inside_out_surface_is_refused():
    surface = surface_of(((0, 0, 0), 1.0, None))
    flipped = SurfaceMesh(vertices=surface.vertices, faces=surface.faces[:, ::-1])
    with pytest.raises(LatticeError, match="encloses no solid"):
        remove_islands(flipped)


def tets_apart(scale):
    """Two tetrahedra that share one vertex only, the second ``scale`` times as long."""
    first = np.vstack([np.zeros(3), np.eye(3)])
    second = -scale * np.eye(3)
    points = np.vstack([first, second]).T
    return TetMesh(points=points, tets=np.array([[0, 1, 2, 3], [0, 5, 4, 6]]).T)


def test_largest_piece_of_tets():
    """Volumes 1 and 0.2^3: pieces joined by a vertex do not hold together."""
    mesh = tets_apart(0.2)
    assert (signed_volumes(mesh) > 0).all()
    kept, dropped, share = largest_components(mesh)
    assert kept.tets.shape == (4, 1)
    assert kept.points.shape == (3, 4)
    assert dropped == 1
    assert share == pytest.approx(0.008 / 1.008)


def test_whole_mesh_is_returned_as_it_is():
    mesh = TetMesh(points=tets_apart(0.2).points[:, :4], tets=[[0], [1], [2], [3]])
    assert largest_components(mesh) == (mesh, 0, 0.0)


def test_mesh_that_falls_apart_is_refused():
    with pytest.raises(LatticeError, match=r"1 disconnected components hold 11\.1 %"):
        largest_components(tets_apart(0.5))
    with pytest.raises(LatticeError, match="no tetrahedra"):
        largest_components(TetMesh(points=np.zeros((3, 0)), tets=np.zeros((4, 0))))
