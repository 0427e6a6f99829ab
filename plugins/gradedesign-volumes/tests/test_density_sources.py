"""Densities from outside: voxels, images, points, tetrahedra, formulas, and their grid."""

import meshio
import numpy as np
import pytest
from PIL import Image

from gradedesign.common.values.formula import parse_formula
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.formats.vtu import write_vtu
from gradedesign.geometry.lattice.density_grid import evaluate
from gradedesign.geometry.lattice.density_source import sample_density
from gradedesign.geometry.lattice.density_value import formula_field
from gradedesign.geometry.lattice.tet_density import tet_density
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign_volumes.image_stack import read_image_stack
from gradedesign_volumes.point_cloud import point_density, read_points, remap_points
from gradedesign_volumes.voxel_density import (
    densities,
    place_voxels,
    read_voxel_array,
    voxel_density,
)
from gradedesign_volumes.vtu_fields import read_vtu_field

BOX = np.array([20.0, 10.0, 10.0])


def box_distance(p):
    """Signed distance of the box [0, 20] x [0, 10] x [0, 10], up to corners outside."""
    half = BOX.reshape(3, *[1] * (p.ndim - 1)) / 2
    return (np.abs(p - half) - half).max(axis=0)


def sampled(source, window=(0.05, 0.6), spacing=1.25):
    return sample_density(
        source, box_distance, [0, 0, 0], BOX, spacing=spacing, window=window, quantity="test"
    )


INSIDE = np.random.default_rng(31).uniform([[0], [0], [0]], BOX[:, None], size=(3, 200))


def test_a_linear_density_is_exact_on_the_grid():
    grid = sampled(lambda p: 0.1 + 0.02 * p[0])
    np.testing.assert_allclose(evaluate(grid, INSIDE), 0.1 + 0.02 * INSIDE[0], atol=1e-12)


def test_outside_the_part_nothing_is_refused():
    # Beyond x = 20 mm the source is not defined, below x = 0 its values are not allowed.
    def source(p):
        return np.where(p[0] > 20.0, np.nan, 0.1 + 0.02 * p[0])

    grid = sampled(source, window=(0.1, 0.5))
    assert np.isfinite(grid.values).all()
    assert grid.values.min() >= 0.1
    assert grid.values.max() <= 0.5


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (lambda p: 0.01 + 0.02 * p[0], r"lowest 0\.01 at \(0, .*allowed are 0\.05 to 0\.6"),
        (lambda p: 0.3 + 0.02 * p[0], r"highest 0\.7 at \(20, "),
        (lambda p: np.where(p[0] > 10, np.nan, 0.3), "not finite"),
        (lambda p: p, "returned shape"),
    ],
    ids=["low", "high", "nan", "shape"],
)
def test_densities_not_allowed_are_named_with_their_place(source, words):
    with pytest.raises(DensityError, match=words):
        sampled(source)


def test_the_depth_of_a_formula_is_that_below_the_surface():
    field = formula_field(parse_formula("0.4 - 0.05 * d"), box_distance)
    points = np.array([[10.0, 10.0, 10.0], [5.0, 1.0, -3.0], [5.0, 5.0, 5.0]])
    np.testing.assert_allclose(field(points), [0.4 - 0.25, 0.4 - 0.05, 0.4])


def test_voxels_are_trilinear_between_centres():
    values = np.arange(24.0).reshape(4, 3, 2) / 30
    lower, size = place_voxels(values.shape, [0, 0, 0], BOX)
    np.testing.assert_allclose(size, [5, 10 / 3, 5])
    source = voxel_density(values, lower, size)
    middle = np.array([[7.5], [5.0], [2.5]])
    assert source(middle)[0] == pytest.approx(values[1, 1, 0])
    between = np.array([[10.0], [5.0], [2.5]])
    assert source(between)[0] == pytest.approx((values[1, 1, 0] + values[2, 1, 0]) / 2)
    assert source(np.array([[-9.0], [5.0], [2.5]]))[0] == pytest.approx(values[0, 1, 0])


def test_grey_values_span_the_stated_densities():
    grey = np.array([[[0, 51, 255]]], dtype=np.uint8)
    np.testing.assert_allclose(densities(grey, (0.1, 0.6)), [[[0.1, 0.2, 0.6]]])
    deep = np.array([[[0, 65535]]], dtype=np.uint16)
    np.testing.assert_allclose(densities(deep, (0.1, 0.6)), [[[0.1, 0.6]]])
    # A denser map gives a denser part: the sign is not turned, as it is in the thesis of 2011.
    assert densities(grey, (0.1, 0.6))[0, 0, 2] > densities(grey, (0.1, 0.6))[0, 0, 0]
    floats = np.array([[[0.2, 0.3]]], dtype=np.float32)
    np.testing.assert_allclose(densities(floats, None), floats)


def test_voxels_that_are_neither_density_nor_grey_are_refused(tmp_path):
    with pytest.raises(CaseError, match="black and white"):
        densities(np.zeros((2, 2, 2), np.uint8), None)
    with pytest.raises(CaseError, match="int64"):
        densities(np.zeros((2, 2, 2), np.int64), (0.1, 0.5))
    with pytest.raises(DensityError, match="not finite"):
        densities(np.full((2, 2, 2), np.nan), None)
    flat = tmp_path / "flat.npy"
    np.save(flat, np.zeros((3, 4)))
    with pytest.raises(CaseError, match=r"\(3, 4\)"):
        read_voxel_array(flat, memory_limit_bytes=10**9)
    objects = tmp_path / "objects.npy"
    np.save(objects, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(CaseError, match="cannot be read"):
        read_voxel_array(objects, memory_limit_bytes=10**9)


def test_an_array_of_the_wrong_size_is_refused():
    with pytest.raises(CaseError, match=r"do not cover .*at least 20 x 10 x 10"):
        place_voxels((10, 10, 10), [0, 0, 0], BOX, voxel_size=1.0)
    lower, size = place_voxels((20, 10, 10), [0, 0, 0], BOX, voxel_size=1.0)
    assert (lower == 0).all()
    assert (size == 1).all()


def stack(folder, images):
    folder.mkdir()
    for name, pixels in images.items():
        Image.fromarray(pixels).save(folder / name)
    return folder


@pytest.mark.parametrize(
    ("suffix", "dtype"), [("png", np.uint8), ("tif", np.uint16), ("tiff", np.float32)]
)
def test_slices_are_read_in_order_with_x_along_columns_and_y_upwards(tmp_path, suffix, dtype):
    # Row 0 is the top of the picture, so the highest y.
    slices = [np.arange(6).reshape(2, 3).astype(dtype) + 10 * n for n in (2, 10)]
    names = (f"slice10.{suffix}", f"slice2.{suffix}")
    folder = stack(tmp_path / "s", dict(zip(names, slices[::-1], strict=True)))
    (folder / "notes.txt").write_text("not an image")
    found = read_image_stack(folder, memory_limit_bytes=10**9, bytes_per_value=18)
    assert found.dtype == dtype
    assert found.shape == (3, 2, 2)
    assert found[0, 0, 0] == slices[0][1, 0]
    assert found[2, 1, 1] == slices[1][0, 2]


def test_broken_stacks_are_refused(tmp_path):
    grey = np.zeros((4, 5), np.uint8)
    with pytest.raises(CaseError, match="holds no image"):
        read_image_stack(stack(tmp_path / "none", {}), memory_limit_bytes=10**9, bytes_per_value=18)
    with pytest.raises(CaseError, match=r"b\.png has 5 x 3 .*a\.png has 5 x 4"):
        read_image_stack(
            stack(tmp_path / "size", {"a.png": grey, "b.png": grey[:3]}),
            memory_limit_bytes=10**9,
            bytes_per_value=18,
        )
    deep = grey.astype(np.uint16)
    with pytest.raises(CaseError, match="uint16"):
        read_image_stack(
            stack(tmp_path / "depth", {"a.png": grey, "b.tif": deep}),
            memory_limit_bytes=10**9,
            bytes_per_value=18,
        )
    with pytest.raises(CaseError, match=r"RGB.*convert it to grey"):
        read_image_stack(
            stack(tmp_path / "colour", {"a.png": np.zeros((4, 5, 3), np.uint8)}),
            memory_limit_bytes=10**9,
            bytes_per_value=18,
        )
    torn = stack(tmp_path / "torn", {"a.png": grey})
    (torn / "a.png").write_bytes((torn / "a.png").read_bytes()[:40])
    with pytest.raises(CaseError, match="cannot be read as an image"):
        read_image_stack(torn, memory_limit_bytes=10**9, bytes_per_value=18)


def test_remap_follows_its_rule():
    # By hand: the grid of 5 mm has 3 x 2 x 2 nodes; the points lie 10 mm apart along x, 5 along
    # y and z, so sensitivity = 10 and tolerance = 2.5.
    x, y, z = np.meshgrid([0.0, 10.0], [0.0, 5.0], [0.0, 5.0], indexing="ij")
    points = np.stack([x, y, z]).reshape(3, -1)
    values = np.where(points[0] > 5, 0.4, 0.2)
    mapped = remap_points(points, values, 5.0)
    assert mapped.values.shape == (3, 2, 2)
    assert (mapped.tolerance, mapped.sensitivity) == (2.5, 10.0)
    np.testing.assert_allclose(mapped.values[0], 0.2)
    np.testing.assert_allclose(mapped.values[2], 0.4)
    np.testing.assert_allclose(mapped.values[1], 0.3)  # half way: equal weights
    assert remap_points(points, values, 5.0, method="maximum").values[1].min() == 0.4


def slow_remap(points, values, nodes, tolerance, sensitivity):
    result = []
    for node in nodes.T:
        apart = np.sqrt(((points.T - node) ** 2).sum(axis=1))
        if (apart <= tolerance).any():
            found = values[apart <= tolerance].max()
        elif (apart <= sensitivity).any():
            near = apart <= sensitivity
            found = (values[near] / apart[near] ** 2).sum() / (1 / apart[near] ** 2).sum()
        else:
            found = values.min()
        result.append(max(found, values.min()))
    return np.array(result)


def test_remap_equals_a_plain_loop():
    rng = np.random.default_rng(7)
    points = rng.uniform(0, 30, size=(3, 60))
    values = rng.uniform(0.1, 0.5, size=60)
    mapped = remap_points(points, values, 6.0)
    axes = [low + s * np.arange(n) for low, s, n in
            zip(mapped.lower, mapped.spacing, mapped.values.shape, strict=True)]  # fmt: skip
    nodes = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    slow = slow_remap(points, values, nodes, mapped.tolerance, mapped.sensitivity)
    np.testing.assert_allclose(mapped.values.ravel(), slow, rtol=1e-12)
    assert mapped.empty > 0
    at_node = point_density(mapped)(nodes[:, :5])
    np.testing.assert_allclose(at_node, mapped.values.ravel()[:5], rtol=1e-9)


def test_an_oversized_map_has_a_border():
    points = np.array([[0, 10], [0, 10], [0, 10.0]])
    mapped = remap_points(points, np.array([0.2, 0.4]), 5.0, oversize=True, outside=0.15)
    assert mapped.values.shape == (5, 5, 5)
    np.testing.assert_allclose(mapped.lower, -5)
    assert (mapped.values[0] == 0.15).all()
    assert mapped.values[1, 1, 1] == 0.2


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p.csv", "x,y,z,rho\n0,0,0,0.2\n1,2,3,0.4\n"),
        ("p.csv", "# made by hand\n0; 0; 0; 0.2\n1; 2; 3; 0.4\n"),
        ("p.txt", "0 0 0 0.2\n\n1\t2 3 4e-1\n"),
    ],
)
def test_points_are_read_from_text(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    points, values = read_points(tmp_path / name, memory_limit_bytes=10**9)
    np.testing.assert_array_equal(points, [[0, 1], [0, 2], [0, 3]])
    np.testing.assert_array_equal(values, [0.2, 0.4])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 0 0\n", "found 3 columns"),
        ("0 0 0 0.2\na b c d\n", "p.txt:2: found 'a b c d'"),
        ("0 0 0 nan\n", "not finite"),
        ("", "shape"),
    ],
)
def test_broken_points_are_refused(tmp_path, text, words):
    (tmp_path / "p.txt").write_text(text)
    with pytest.raises(CaseError, match=words):
        read_points(tmp_path / "p.txt", memory_limit_bytes=10**9)


def test_points_in_a_plane_span_no_grid():
    with pytest.raises(DensityError, match="span no grid"):
        remap_points(np.array([[0, 1], [0, 1], [0, 0.0]]), np.array([0.2, 0.4]), 0.5)


TET = TetMesh(
    points=np.array([[0, 10, 0, 0, 10], [0, 0, 10, 0, 10], [0, 0, 0, 10, 10.0]]),
    tets=np.array([[0, 1], [1, 4], [2, 2], [3, 3]]),
)


def test_a_vtu_field_at_points_is_interpolated(tmp_path):
    values = 0.2 + 0.01 * TET.points[0] + 0.02 * TET.points[2]
    file = tmp_path / "a.vtu"
    write_vtu(file, TET, point_data={"relative_density [-]": values, "other [mm]": values})
    with pytest.raises(CaseError, match="'other \\[mm\\]' at points"):
        read_vtu_field(file)
    mesh, found, at = read_vtu_field(file, "relative_density [-]")
    assert at == "points"
    source = tet_density(mesh, found, at=at, spacing=1.0, reach=5.0)
    inside = np.array([[1.0, 4.0], [1.0, 4.0], [1.0, 4.5]])
    np.testing.assert_allclose(source(inside), 0.2 + 0.01 * inside[0] + 0.02 * inside[2], atol=1e-7)
    with pytest.raises(DensityError, match="mesh of this part"):
        source(np.array([[100.0], [0.0], [0.0]]))


def test_a_vtu_field_of_elements_is_spread_as_a_run_spreads_it(tmp_path):
    file = tmp_path / "a.vtu"
    write_vtu(file, TET, cell_data={"rho [-]": np.array([0.3, 0.3])})
    mesh, found, at = read_vtu_field(file)
    assert at == "elements"
    source = tet_density(mesh, found, at=at, spacing=1.0, reach=5.0)
    np.testing.assert_allclose(source(np.array([[2.0], [2.0], [2.0]])), 0.3, atol=1e-7)


def test_vtu_files_that_do_not_fit_are_refused(tmp_path):
    text = tmp_path / "a.vtu"
    text.write_text("not xml")
    with pytest.raises(CaseError, match="cannot be read as VTU"):
        read_vtu_field(text)
    flat = tmp_path / "b.vtu"
    meshio.vtu.write(flat, meshio.Mesh(TET.points.T, [("triangle", np.array([[0, 1, 2]]))]))
    with pytest.raises(CaseError, match="holds triangle; expected tetrahedra"):
        read_vtu_field(flat)
    bare = tmp_path / "c.vtu"
    write_vtu(bare, TET)
    with pytest.raises(CaseError, match="it has: none"):
        read_vtu_field(bare)


def test_tetrahedra_numbered_the_other_way_are_turned(tmp_path):
    file = tmp_path / "a.vtu"
    cells = [("tetra", TET.tets[[1, 0, 2, 3]].T)]
    meshio.vtu.write(file, meshio.Mesh(TET.points.T, cells, cell_data={"rho": [np.full(2, 0.3)]}))
    mesh, values, _ = read_vtu_field(file)
    np.testing.assert_array_equal(mesh.tets, TET.tets)
    assert (values == 0.3).all()
