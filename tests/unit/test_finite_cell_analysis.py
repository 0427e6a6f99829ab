"""Finite cells behind the protocol of explicit analyses: fields, files, memory, a given field."""

from dataclasses import replace

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.errors import LatticeError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.formats.vtu import write_vtu
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume
from gradedesign.mechanics.explicit import bricks_within_budget
from gradedesign.mechanics.explicit.analysis import PlannedSolid, Resolution
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS, solve_finite_cells
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec, LoadSpec
from gradedesign.mechanics.material.material import Material

BOX = np.array([4.0, 2.0, 1.0])
STEEL = Material(
    name="steel", youngs_modulus=200e3, poissons_ratio=0.3, density=7.8e-9, yield_strength=300.0
)


def face(axis, side):
    """A face of the box as a region of two triangles, normal outward."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    quad = np.zeros((4, 3))
    quad[:, axis] = side * BOX[axis]
    quad[1:3, b] = BOX[b]
    quad[2:, c] = BOX[c]
    quad = quad if side else quad[::-1]
    name = f"{'xyz'[axis]}{side}"
    return Region(
        name=name, triangles=np.arange(2), corners=quad[[[0, 1, 2], [0, 2, 3]]],
        area=float(BOX[b] * BOX[c]), centroid=quad.mean(axis=0), faces=(0,),
    )  # fmt: skip


def box(points):
    shape = (3, *[1] * (points.ndim - 1))
    return np.maximum(-points, points - BOX.reshape(shape)).max(axis=0)


def bar(memory=8e9, field=None):
    """A bar of 4 x 2 x 1 mm, all skin, pulled along x by 5 N: 2.5 MPa."""
    pull = LoadCaseSpec(
        name="pull",
        fix=[FixSpec(region=f"{c}0", components=c) for c in "xyz"],
        load=[LoadSpec(region="x1", force=["5 N", "0 N", "0 N"])],
    )
    design = LatticeDesign(
        domain=DesignDomain(
            distance=box, lower=(0, 0, 0), upper=BOX, components=(Skin(thickness=1.5),)
        ),
        cells=plain_cells(lambda u: np.cos(2 * np.pi * u).sum(axis=0), -3.0, 3.0),
        cell_map=lambda p: p / 2.0,
        cell_size=2.0,
        density=0.3,
    )
    return PrintedSolid(
        load_cases=(pull,),
        memory=memory,
        design=design,
        material=STEEL,
        regions={
            name: face("xyz".index(name[0]), int(name[1])) for name in ("x0", "y0", "z0", "x1")
        },
        support_zones=(),
        stress_limit=None,
        percentile=99.0,
        field=field,
    )


@pytest.fixture(scope="module")
def solved():
    return solve_finite_cells(bar(), Resolution(spacing=1.0), print)


def moved(points):
    """Exact displacement of the bar."""
    return 2.5 / 200e3 * np.array([[1.0], [-0.3], [-0.3]]) * points


def test_stress_and_displacement_are_known_inside_and_outside(solved):
    assert solved.load_cases == ("pull",)
    assert solved.volumes.sum() == pytest.approx(8.0, rel=1e-6)
    assert solved.von_mises("pull") == pytest.approx(2.5, rel=1e-3)
    low, high = np.array([1.0, 0.5, 0.0]), np.array([3.0, 1.5, 1.0])
    sample = solved.stress_within("pull", low, high)
    assert sample.volumes.sum() == pytest.approx(2.0, rel=1e-6)
    assert sample.stress[0, 0] == pytest.approx(2.5, rel=1e-3)
    points = np.array(
        [[1.0, 3.9, 4.4, 2.0, 4.0], [0.5, 1.0, 1.0, 9.0, 2.0], [0.5, 0.9, 0.5, 0.5, 1.0]]
    )
    u, distance = solved.displacement_at("pull", points)
    assert distance == pytest.approx([0.0, 0.0, 0.4, 7.0, 0.0], abs=1e-6)
    nearest = np.minimum(points, BOX[:, None])
    np.testing.assert_allclose(u, moved(nearest), rtol=1e-3, atol=1e-3 * 2.5 / 200e3)


def test_pictures_hold_walls_thinner_than_their_usual_grid(monkeypatch):
    # From a block a wall of 0.5 mm: it holds two planes of the sub-cells of bricks of 1 mm, but one
    # of the usual grid of 0.56 mm.
    wall = bar(
        field=lambda p: np.maximum(box(p), np.minimum(p[0] - 0.5, np.abs(p[1] - 0.85) - 0.25))
    )
    # The ridge of the field takes a tenth of the wall off its elements.
    monkeypatch.setattr(bricks_within_budget, "VOLUME_TOLERANCE", 0.2)
    thin = solve_finite_cells(wall, Resolution(spacing=1.0), print)
    surface = thin.surface_fields("pull").surface
    assert enclosed_volume(surface) == pytest.approx(thin.volumes.sum(), rel=0.05)
    usual = extract_surface(wall.field, np.zeros(3), BOX, thin.division.surface_size)
    assert enclosed_volume(usual) < 0.85 * thin.volumes.sum()


def test_pictures_and_files_get_the_surface_and_hexahedra(solved, tmp_path):
    fields = solved.surface_fields("pull")
    assert fields.von_mises == pytest.approx(2.5, rel=1e-3)
    np.testing.assert_allclose(
        fields.displacement, moved(fields.surface.vertices.T), atol=1e-3 * 2.5 / 200e3
    )
    volume = solved.volume_fields({"x [mm]": solved.points[0]})
    assert volume.elements.shape == (27, 8)
    middle = volume.points[:, volume.elements].mean(axis=1)
    np.testing.assert_allclose(volume.element_data["x [mm]"], middle[0], atol=1e-9)
    assert volume.element_data["solid_volume_fraction [-]"] == pytest.approx(1.0)
    path = tmp_path / "bar.vtu"
    write_vtu(
        path, (volume.points, volume.elements), point_data=volume.point_data,
        cell_data=volume.element_data,
    )  # fmt: skip
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(path)
    # VTK's own mid-points and its volume agree only in VTK's order of nodes.
    assert set(grid.celltypes) == {29}
    assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(8.0, rel=1e-6)
    at = np.array([[0.3, 0.4, 0.2], [3.4, 1.7, 0.9], [2.6, 0.1, 0.45]])
    probed = pyvista.PolyData(at).sample(grid)["displacement pull [mm]"]
    np.testing.assert_allclose(probed.T, moved(at.T), rtol=1e-3, atol=1e-3 * 2.5 / 200e3)


def test_elements_are_twice_as_large_where_the_memory_asks_and_walls_allow():
    said = []
    small = bar(memory=300_000_000 + 480 * 1500)
    thick = replace(small, grading=lambda p: np.where(p[0] > 2.1, 1.0, 2.5))
    refined = solve_finite_cells(thick, Resolution(spacing=0.5, coarsest=0.7), said.append)
    assert "taking twice that where walls are thick" in said[0]
    # What is compared with other spacings is divided evenly or not at all.
    with pytest.raises(ResourceError, match=r"more than \[run\] memory"):
        solve_finite_cells(thick, Resolution(spacing=0.5), print)
    enough = replace(thick, memory=bar().memory)
    even = solve_finite_cells(enough, Resolution(spacing=0.5, coarsest=0.7), print)
    assert even.result.space.hanging is None
    # Two blocks across of 1 mm where x < 2, and 32 bricks of 0.5 mm: an even grid has 64.
    assert np.bincount(refined.result.elements.size).tolist() == [0, 32, 4]
    assert refined.division.mesh_size == 0.5
    # Of 9 x 9 x 5 nodes where elements are small those on their plane with large ones hang that
    # lie not on its 5 x 3; large ones have 4 x 5 x 3 more.
    assert refined.division.unknowns == 3 * (9 * 9 * 5 - 9 * 5 + 5 * 3 + 4 * 5 * 3)
    assert refined.volumes.sum() == pytest.approx(8.0, rel=1e-6)
    assert refined.von_mises("pull") == pytest.approx(2.5, rel=1e-3)
    points = np.array([[0.7, 2.1, 3.9], [0.3, 1.1, 1.9], [0.9, 0.2, 0.6]])
    u, _ = refined.displacement_at("pull", points)
    np.testing.assert_allclose(u, moved(points), rtol=1e-3, atol=1e-3 * 2.5 / 200e3)
    volume = refined.volume_fields({"x [mm]": refined.points[0]})
    middle = volume.points[:, volume.elements].mean(axis=1)
    np.testing.assert_allclose(volume.element_data["x [mm]"], middle[0], atol=1e-9)
    nodal = volume.point_data["displacement pull [mm]"]
    np.testing.assert_allclose(nodal, moved(volume.points), atol=1e-3 * 2.5 / 200e3)


def test_a_given_field_is_analysed_in_place_of_the_design():
    half = solve_finite_cells(
        bar(field=lambda p: np.maximum(box(p), p[1] - 1.0)), Resolution(spacing=1.0), print
    )
    assert half.volumes.sum() == pytest.approx(4.0, rel=1e-6)
    # Every section carries 5 N on 1 mm^2; the load acts at the middle of the whole face, which
    # bends the half.
    sample = half.stress_within("pull", np.zeros(3), BOX)
    assert np.average(sample.stress[0, 0], weights=sample.volumes) == pytest.approx(5.0, rel=1e-3)


def test_a_grid_follows_the_memory_and_the_walls():
    solid, said = bar(), []
    fine = solve_finite_cells(solid, Resolution(spacing=0.5), print).division
    assert fine.requested == fine.mesh_size == 0.5
    # 64 bricks of 0.5 mm have 17 x 9 x 5 nodes.
    assert fine.unknowns == 3 * 17 * 9 * 5
    small = bar(memory=300_000_000 + 480 * 1500)
    with pytest.raises(ResourceError, match=r"need 0\.301 GB, more than \[run\] memory 0\.301 GB"):
        solve_finite_cells(small, Resolution(spacing=0.5), print)
    coarser = solve_finite_cells(small, Resolution(spacing=0.5, coarsest=0.7), said.append)
    assert 0.5 < coarser.division.mesh_size <= 0.7
    assert coarser.division.refused == tuple(said)
    assert "taking" in said[0]
    # A wall of 0.2 mm between the samples of a brick of 2 mm is lost.
    wall = replace(solid, field=lambda p: np.maximum(box(p), np.abs(p[1] - 1.3) - 0.1))
    with pytest.raises(LatticeError, match=r"no finite cell holds solid|too coarse"):
        solve_finite_cells(wall, Resolution(spacing=2.0), print)


def test_an_estimate_is_near_what_is_solved(solved):
    planned = PlannedSolid(box=tuple(BOX), volume=8.0, projections=0.0, curvature=0.0, load_cases=1)
    found = FINITE_CELLS.estimate(planned, 0.5)
    assert 0.5 < found.unknowns / (3 * 17 * 9 * 5) < 2.0
    assert found.memory_bytes > 3e8
    assert FINITE_CELLS.fitted_spacing(planned, 0.9, 8e9) == pytest.approx(0.8)
    more = FINITE_CELLS.estimate(replace(planned, load_cases=3), 0.5)
    assert found.solve_s < more.solve_s < 3 * found.solve_s
