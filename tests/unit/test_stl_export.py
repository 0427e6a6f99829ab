"""Binary STL: what the format says, checked with an independent reader."""

import numpy as np
import pytest
import trimesh

from gradedesign.errors import CaseError, LatticeError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface, require_closed
from gradedesign.geometry.formats import write_stl as stl
from gradedesign.geometry.formats.read_back import require_read_back
from gradedesign.geometry.formats.write_stl import float32_vertices, surface_of_stl, write_stl
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume


@pytest.fixture(scope="module")
def ball():
    return extract_surface(
        lambda p: np.linalg.norm(p - 100.3, axis=0) if p.ndim == 1
        else np.sqrt(((p - 100.3) ** 2).sum(axis=0)) - 2.0,
        [97] * 3, [103] * 3, 0.25,
    )  # fmt: skip


def test_file_is_what_trimesh_expects(tmp_path, ball):
    path = tmp_path / "ball.stl"
    write_stl(path, ball)
    assert path.stat().st_size == 84 + 50 * len(ball.faces)
    head = path.read_bytes()[:80]
    assert head.startswith(b"gradedesign")
    assert b"unit mm" in head
    mesh = trimesh.load_mesh(path)
    assert len(mesh.faces) == len(ball.faces)
    assert len(mesh.vertices) == len(ball.vertices)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(enclosed_volume(ball), rel=1e-5)
    np.testing.assert_allclose(
        mesh.triangles, ball.vertices[ball.faces].astype(np.float32), atol=1e-4
    )


def test_normals_have_unit_length_and_point_out(tmp_path, ball):
    path = tmp_path / "ball.stl"
    write_stl(path, ball)
    records = np.frombuffer(path.read_bytes()[84:], dtype=stl._RECORD)
    np.testing.assert_allclose(np.linalg.norm(records["normal"], axis=1), 1, atol=1e-5)
    outward = records["corners"].mean(axis=1) - 100.3
    assert (np.einsum("ij,ij->i", outward, records["normal"]) > 0).all()
    assert (records["attribute"] == 0).all()


def test_vertices_that_float32_joins_are_moved_apart():
    """At 1000 mm float32 steps by 6.1e-5 mm."""
    close = np.array([[1000.0, 0, 0], [1000.00001, 0, 0], [1000.00002, 0, 0], [5, 5, 5]])
    apart = float32_vertices(close)
    assert len(np.unique(apart, axis=0)) == 4
    np.testing.assert_array_equal(apart, apart.astype(np.float32))
    assert np.abs(apart - close).max() < 4 * 6.2e-5


def test_detail_beyond_float32_is_refused():
    line = 1e6 + np.linspace(0, 1e-3, 40)
    with pytest.raises(LatticeError, match="fall together in the float32"):
        float32_vertices(np.stack([line, line, line], axis=1))


def test_empty_surface_is_refused(tmp_path):
    empty = SurfaceMesh(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3)))
    with pytest.raises(LatticeError, match="the surface has 0"):
        write_stl(tmp_path / "none.stl", empty)
    assert not list(tmp_path.iterdir())


def test_missing_folder_is_refused(tmp_path, ball):
    with pytest.raises(CaseError, match="cannot write"):
        write_stl(tmp_path / "nowhere" / "ball.stl", ball)


@pytest.mark.parametrize("damage", ["cut", "count", "volume"])
def test_damage_is_found_on_reading_back(tmp_path, ball, damage):
    path = tmp_path / "ball.stl"
    write_stl(path, ball)
    data = bytearray(path.read_bytes())
    if damage == "cut":
        data = data[:-7]
    elif damage == "count":
        data[80] ^= 1
    else:
        data[84 + 12 : 84 + 16] = np.float32(300.0).tobytes()
    path.write_bytes(data)
    with pytest.raises(ResourceError, match="reads back as"):
        require_read_back(path, stl._pieces(path, len(ball.faces)), ball)


def test_the_surface_of_a_written_file_is_the_surface(tmp_path, ball):
    """Equal corners are one vertex again, whatever their order, and nothing else is changed."""
    path = tmp_path / "ball.stl"
    write_stl(path, ball)
    back = surface_of_stl(path.read_bytes(), "ball.stl")
    assert len(back.vertices) == len(ball.vertices)
    np.testing.assert_array_equal(
        back.vertices[back.faces], float32_vertices(ball.vertices)[ball.faces]
    )
    assert require_closed(back) == pytest.approx(enclosed_volume(ball), rel=1e-5)


def test_a_file_of_another_size_is_no_surface(tmp_path, ball):
    path = tmp_path / "ball.stl"
    write_stl(path, ball)
    for data in (path.read_bytes()[:-50], path.read_bytes()[:70], b""):
        with pytest.raises(ResourceError, match="bytes for"):
            surface_of_stl(data, "ball.stl")
