"""Every mesh file is read back: one triangle turned or gone is found, in pieces too."""

import numpy as np
import pytest
import trimesh

from gradedesign.design.resolve.lattice_files import crossing_warnings
from gradedesign.errors import ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.read_back import edge_balance
from gradedesign.geometry.formats.write_stl import export_stl
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign_formats.write_3mf import export_3mf
from gradedesign_formats.write_ply import export_ply
from gradedesign_formats.write_trimesh import export_glb, export_obj, export_off

BALL = extract_surface(lambda p: np.sqrt((p**2).sum(axis=0)) - 2.0, [-3] * 3, [3] * 3, 0.25)
EXPORTS = (export_stl, export_3mf, export_obj, export_ply, export_off, export_glb)


def with_one_turned(surface):
    faces = surface.faces.copy()
    faces[10] = faces[10, ::-1]
    return SurfaceMesh(vertices=surface.vertices, faces=faces)


def test_pieces_of_a_closed_surface_balance_together_only():
    corners = BALL.vertices[BALL.faces]
    half = len(corners) // 2
    parts = edge_balance(corners[:half]), edge_balance(corners[half:])
    assert all(parts)
    assert sum(parts) % 2**64 == 0
    assert edge_balance(corners[1:]) != 0
    assert edge_balance(np.concatenate([corners, corners])) == 0


@pytest.mark.parametrize("export", EXPORTS)
def test_a_name_with_markup_is_written_and_an_open_surface_is_not(tmp_path, export):
    path = tmp_path / f"a.{export.__name__.rpartition('_')[2]}"
    export(path, PrintedLattice(surface=BALL, name='R&D <ball> "7"'))
    if path.suffix in (".obj", ".ply"):
        assert 'name: R&D <ball> "7"' in path.read_bytes().decode("utf-8", "replace")
    if path.suffix == ".glb":
        assert 'R&D <ball> "7"' in trimesh.load_scene(path).geometry
    # A turned triangle of 1500 changes the volume by 0.1 % or less.
    with pytest.raises(ResourceError, match="do not close"):
        export(path, PrintedLattice(surface=with_one_turned(BALL), name="turned"))


def test_a_surface_that_crosses_itself_is_told_with_the_place():
    assert crossing_warnings(BALL) == ()
    two = SurfaceMesh(
        vertices=np.concatenate([BALL.vertices, BALL.vertices + np.array([3.0, 0, 0])]),
        faces=np.concatenate([BALL.faces, BALL.faces + len(BALL.vertices)]),
    )
    (told,) = crossing_warnings(two)
    assert "triangles of the printed surface pass through others" in told
    assert "at (1.5" in told or "at (1.4" in told or "at (1.6" in told
