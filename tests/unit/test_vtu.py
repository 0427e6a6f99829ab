"""VTU files, read back by VTK itself."""

import numpy as np
import pytest
import pyvista

from gradedesign.errors import CaseError
from gradedesign.geometry.formats.vtu import write_vtu
from gradedesign.geometry.tets.tet_mesh import TetMesh

POINTS = np.array([[0.0, 2, 0, 0, 2], [0, 0, 2, 0, 2], [0, 0, 0, 2, 2]])
MESH = TetMesh(points=POINTS, tets=np.array([[0, 1, 2, 3], [1, 2, 3, 4]]).T)
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def test_linear_mesh_with_fields(tmp_path):
    path = tmp_path / "a.vtu"
    shift = np.arange(15.0).reshape(3, 5)
    stress = np.arange(18.0).reshape(3, 3, 2)
    write_vtu(
        path,
        MESH,
        point_data={"displacement [mm]": shift},
        cell_data={"density [-]": [0.2, 0.4], "stress [MPa]": stress},
    )
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.points, POINTS.T)
    np.testing.assert_array_equal(grid.cells_dict[10], MESH.tets.T)
    np.testing.assert_array_equal(grid.point_data["displacement [mm]"], shift.T)
    np.testing.assert_allclose(grid.cell_data["density [-]"], [0.2, 0.4], rtol=1e-7)
    np.testing.assert_array_equal(grid.cell_data["stress [MPa]"][1], stress[:, :, 1].ravel())
    assert [p.name for p in tmp_path.iterdir()] == ["a.vtu"]


def test_quadratic_order_is_that_of_vtk(tmp_path):
    """VTK's own volume of a bulged tetrahedron: each edge node pushed out in turn."""
    corners = POINTS[:, :4]
    middle = np.stack([corners[:, list(e)].mean(axis=1) for e in EDGES], axis=1)
    nodes = np.hstack([corners, middle])
    path = tmp_path / "q.vtu"
    write_vtu(path, (nodes, np.arange(10)[:, None]), point_data={"x [mm]": nodes[0]})
    cell = pyvista.read(path).get_cell(0)
    assert cell.type == pyvista.CellType.QUADRATIC_TETRA
    for edge, (a, b) in enumerate(EDGES):
        ends = cell.edges[edge].points
        np.testing.assert_allclose(np.sort(ends[:2], axis=0), np.sort(nodes[:, [a, b]].T, axis=0))
        np.testing.assert_allclose(ends[2], nodes[:, 4 + edge])


def test_data_is_left_alone(tmp_path):
    rho = np.array([0.2, 0.4])
    write_vtu(tmp_path / "a.vtu", MESH, cell_data={"density [-]": rho})
    assert rho.dtype == np.float64
    np.testing.assert_array_equal(rho, [0.2, 0.4])


@pytest.mark.parametrize(
    ("data", "match"),
    [
        ({"density": [0.1, 0.2]}, "lacks its unit"),
        ({"density [-]": [0.1, 0.2, 0.3]}, "expected \\(..., 2\\) for elements"),
        ({"density [-]": 0.1}, "expected \\(..., 2\\) for elements"),
    ],
)
def test_bad_fields_are_refused(tmp_path, data, match):
    with pytest.raises(ValueError, match=match):
        write_vtu(tmp_path / "a.vtu", MESH, cell_data=data)
    assert not list(tmp_path.iterdir())


def test_other_cells_are_refused(tmp_path):
    with pytest.raises(ValueError, match="k one of 4, 8, 10, 27"):
        write_vtu(tmp_path / "a.vtu", (POINTS, np.arange(5)[:, None]))


def test_missing_folder_is_refused(tmp_path):
    with pytest.raises(CaseError, match="cannot write"):
        write_vtu(tmp_path / "nowhere" / "a.vtu", MESH)
