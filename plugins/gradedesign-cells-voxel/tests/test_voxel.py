"""Cells from voxels, meshes and increments; expected numbers are elementary geometry."""

import importlib.util
import re
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from gradedesign import CaseError, PartError, PluginError, RawTriangles, SurfaceMesh
from gradedesign.fields import periodic_distance_to_segments, periodic_spline
from gradedesign.testing import check_cell_family
from gradedesign_cells_voxel import (
    cell_from_increments,
    cell_from_mesh,
    cell_from_nested_increments,
    cell_from_voxels,
    gradedesign_cell_families,
)
from gradedesign_cells_voxel.helix_library import AMPLITUDE, COUNT, helices
from gradedesign_cells_voxel.mesh_cell import inside_surface
from gradedesign_cells_voxel.read_mesh import read_mesh
from gradedesign_cells_voxel.stored_cells import increments
from gradedesign_cells_voxel.triangle_distance import periodic_triangle_distance
from gradedesign_cells_voxel.voxel_cell import VoxelReading, voxel_surface

FAMILIES = {family.name: family for family in gradedesign_cell_families()}
README = Path(__file__).parents[1] / "README.md"


def samples(count=100_000):
    """Points that fill the cell evenly: an additive recurrence with the plastic number's kin."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.mod(0.3141 + step[:, None] * np.arange(count), 1.0)


def nodes(count, start=0.5):
    axis = (np.arange(count) + start) / count
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))


def primitive(u):
    """Solid where at most 0: half of the cell."""
    return -np.cos(2 * np.pi * u).sum(axis=0)


def block_mesh(edges, solid):
    """Triangles around the solid blocks of a grid, caps included; edges by axis."""
    full = np.pad(solid, 1)
    found = []
    for axis, towards in product(range(3), (0, 1)):
        outside = ~np.roll(full, 1 - 2 * towards, axis)[1:-1, 1:-1, 1:-1]
        for block in np.argwhere(solid & outside):
            one, other = (axis + 1) % 3, (axis + 2) % 3
            corner = np.zeros((4, 3))
            corner[:, axis] = edges[axis][block[axis] + towards]
            corner[:, one] = edges[one][block[one] + np.array([0, 1, 1, 0])]
            corner[:, other] = edges[other][block[other] + np.array([0, 0, 1, 1])]
            ring = corner if towards else corner[::-1]
            found += [ring[[0, 1, 2]], ring[[0, 2, 3]]]
    return np.array(found)


def bars(half=0.2, size=1.0):
    """Closed surface of three crossing square bars in a cell: seven blocks."""
    line = size * np.array([0.0, 0.5 - half, 0.5 + half, 1.0])
    place = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"))
    return block_mesh([line] * 3, (place == 1).sum(axis=0) >= 2)


def write_stl(path, corners):
    record = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    record["c"] = corners
    path.write_bytes(b"cell".ljust(80) + len(corners).to_bytes(4, "little") + record.tobytes())


@pytest.mark.parametrize(
    "family", [pytest.param(f, id=name, marks=pytest.mark.slow) for name, f in FAMILIES.items()]
)
def test_conforms(family):
    check_cell_family(family)


@pytest.mark.slow
def test_a_cell_of_ones_own_conforms():
    grey = -primitive(nodes(16))
    check_cell_family(cell_from_voxels(grey, name="my-cell", resolution=24, symmetry="cubic"))


def test_every_cell_is_there():
    assert set(FAMILIES) == {"bcc-straight-to-helix", "bcc-triangle-increments", "kelvin-voxel"}


def slow_distance(corners, points):
    """Distance to triangles and their copies by dense sampling of each, from above."""
    v, w = np.array([(i / 40, j / 40) for i in range(41) for j in range(41 - i)]).T
    a, b, c = (corners[:, k, :, None] for k in range(3))
    spots = (a + v * (b - a) + w * (c - a)).transpose(1, 0, 2).reshape(3, -1)
    least = np.full(points.shape[1], np.inf)
    for shift in product((-1.0, 0.0, 1.0), repeat=3):
        for i, point in enumerate(points.T):
            apart = spots + np.array(shift)[:, None] - point[:, None]
            least[i] = min(least[i], np.sqrt((apart**2).sum(axis=0).min()))
    return least


def test_periodic_distance_to_triangles():
    rng = np.random.default_rng(77)
    corners = np.clip(rng.uniform(size=(7, 1, 3)) + rng.uniform(-0.2, 0.2, (7, 3, 3)), 0, 1)
    points = rng.uniform(size=(3, 60))
    found = periodic_triangle_distance(corners, points)
    slow = slow_distance(corners, points)
    # Samples of a triangle of sides below 0.6 are at most 0.6 / 40 apart.
    assert (found <= slow + 1e-12).all()
    np.testing.assert_allclose(found, slow, atol=0.6 / 40)
    np.testing.assert_allclose(found, periodic_triangle_distance(corners, points + 2.0), atol=1e-12)
    # One triangle in z = 0.4, from right above, from beyond an edge and from the next cell.
    flat = np.array([[[0.2, 0.2, 0.4], [0.8, 0.2, 0.4], [0.2, 0.8, 0.4]]])
    three = np.array([[0.3, 0.3, 0.6], [0.5, 0.1, 0.4], [0.3, 0.3, 0.95]]).T
    found = periodic_triangle_distance(flat, three)
    np.testing.assert_allclose(found, [0.2, 0.1, 0.45], atol=1e-12)


def test_inside_is_exact_on_edges_and_corners():
    # Columns through edges, corners and faces of the blocks: nodes count as moved to larger ones.
    axis = np.arange(20) / 20
    found = inside_surface(np.round(bars() * 2**20) / 2**20, axis)
    within = (axis >= np.round(0.3 * 2**20) / 2**20) & (axis < np.round(0.7 * 2**20) / 2**20)
    count = within[:, None, None].astype(int) + within[None, :, None] + within[None, None, :]
    np.testing.assert_array_equal(found, count >= 2)


@pytest.mark.parametrize("kind", ["array", "file", "surface", "raw"])
def test_mesh_of_bars(kind, tmp_path):
    corners = bars(0.2, 10.0)
    write_stl(tmp_path / "cell.STL", corners)
    faces = np.arange(len(corners) * 3).reshape(-1, 3)
    mesh = {
        "array": corners,
        "file": tmp_path / "cell.STL",
        "surface": SurfaceMesh(vertices=corners.reshape(-1, 3), faces=faces),
        "raw": RawTriangles(corners=corners),
    }[kind]
    shape = cell_from_mesh(mesh, name="bars", resolution=32).shape
    w = 0.4
    # So many evenly spread points count to about 2e-4, a tenth of what random ones would miss; the
    # spline rounds ridges over a step of 1/32 and is exact on planes. Bars 1 % too thick have
    # 0.0056 more volume and surfaces 0.002 away.
    assert np.mean(shape(samples()) <= 0) == pytest.approx(3 * w**2 - 2 * w**3, abs=5e-4)
    # No cap counts: on the axis of a bar at the cell's face the surface is half a width away.
    spots = np.array([[0.0, 0.5, 0.5], [0.5, 0.5, 0.0], [0.0, 0.0, 0.0], [0.1, 0.5, 0.85]]).T
    expected = [-0.2, -0.2, 0.3 * 2**0.5, 0.15]
    np.testing.assert_allclose(shape(spots), expected, atol=5e-4)
    np.testing.assert_allclose(shape(spots + 1.0), shape(spots), atol=1e-9)


def test_a_box_in_mm_fits_a_surface_in_metres():
    corners, box = bars(0.2, 10.0), [[0.0, 0.0, 0.0], [10.0, 10.0, 10.0]]
    found = read_mesh(RawTriangles(corners=corners / 1000.0, unit="m"), box)
    np.testing.assert_allclose(found, read_mesh(corners, box), atol=1e-6)


@pytest.mark.slow
def test_mesh_of_a_ball_in_its_box():
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=3.0)
    mesh = np.array(ball.triangles) + 5.0
    family = cell_from_mesh(mesh, name="ball", box=[[0, 0, 0], [10, 10, 10]], resolution=32)
    points = samples(4000)
    apart = points - 0.5
    exact = np.linalg.norm(apart - np.round(apart), axis=0) - 0.3
    # Facets lie inside the ball by at most 0.3 / 8 * (0.14 rad)^2; the spline rounds the middle.
    away = np.abs(exact + 0.3) > 0.05
    ridge = np.abs(np.abs(apart).max(axis=0) - 0.5) < 0.05
    error = np.abs(family.shape(points) - exact)[away & ~ridge]
    assert error.max() < 2e-3


@pytest.mark.parametrize(
    ("corners", "settings", "message"),
    [
        (bars()[:-1], {}, "not closed: .* lines along z"),
        (bars()[:, ::-1], {}, "inside out"),
        (bars(), {"box": [[0, 0, 0], [0.5, 1, 1]]}, "leaves the cell's box"),
        (bars(), {"box": [[0, 0, 0], [0, 1, 1]]}, "box .* is impossible"),
        (np.zeros((0, 3, 3)), {}, r"shape \(0, 3, 3\)"),
        (np.full((4, 3, 3), np.nan), {}, "36 coordinates are not finite"),
        (block_mesh([np.array([0.0, 1.0])] * 3, np.ones((1, 1, 1), bool)), {}, "all solid"),
    ],
)
def test_unusable_meshes_are_refused(corners, settings, message):
    family = cell_from_mesh(corners, name="bad", resolution=24, **settings)
    with pytest.raises(PluginError, match=message):
        family.shape(np.zeros(3))


def test_a_mesh_that_does_not_repeat_is_refused():
    # A bar along x that ends at the middle of the cell: the faces differ by its section, 0.4^2.
    line = np.array([0.0, 0.3, 0.7, 1.0])
    place = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"))
    solid = (place == 1).sum(axis=0) >= 2
    solid[2, 1, 1] = False
    family = cell_from_mesh(block_mesh([line] * 3, solid), name="bad", box=[[0] * 3, [1] * 3])
    with pytest.raises(PluginError, match=r"repeat along x: .* differs in 1[5-7]\.\d% of the face"):
        family.shape(np.zeros(3))
    # Allowed, and the bar ends there.
    family = cell_from_mesh(
        block_mesh([line] * 3, solid), name="odd", box=[[0] * 3, [1] * 3], tolerance=0.2
    )
    assert float(family.shape(np.array([0.85, 0.5, 0.5]))) > 0.1


def test_mesh_files_go_to_their_readers(tmp_path):
    family = cell_from_mesh(tmp_path / "cell.docx", name="bad")
    with pytest.raises(PluginError, match=r"no installed reader knows '.docx'.*\.stl"):
        family.shape(np.zeros(3))
    np.save(tmp_path / "volume.npy", np.ones((4, 4, 4)))
    family = cell_from_mesh(tmp_path / "volume.npy", name="bad")
    with pytest.raises(PluginError, match=r"volume.npy holds a voxel volume; expected triangles"):
        family.shape(np.zeros(3))
    family = cell_from_mesh(tmp_path / "missing.stl", name="bad")
    with pytest.raises(PartError, match="cannot be read"):
        family.shape(np.zeros(3))
    with pytest.raises(PluginError, match="resolution is 8"):
        cell_from_mesh(bars(), name="bad", resolution=8)


@pytest.mark.parametrize("start", [0.0, 0.5])
@pytest.mark.parametrize(("interpolation", "error"), [("cubic", 2e-4), ("linear", 2e-2)])
def test_interpolation_is_periodic_and_exact_at_nodes(start, interpolation, error):
    def wave(u):
        return np.sin(2 * np.pi * (u[0] + 2 * u[1] - u[2]))

    grid = nodes(24, start)
    field = periodic_spline(wave(grid), start=start, interpolation=interpolation)
    np.testing.assert_allclose(field(grid - 3.0), wave(grid), atol=1e-9)
    points = samples(2000) * 3 - 1
    # Of 12 nodes in a wave: h^2 k^2 / 8 for linear in one direction, fourth order for cubic.
    assert np.abs(field(points) - wave(points)).max() < (0.5 if interpolation == "linear" else 0.01)
    smooth = periodic_spline(np.cos(2 * np.pi * grid).sum(axis=0), start=start,
                             interpolation=interpolation)  # fmt: skip
    assert np.abs(smooth(points) + primitive(points)).max() < 3 * max(error, 1e-4)


@pytest.mark.parametrize("form", ["array", "npy", "npz", "slices", "float32"])
def test_grey_voxels(form, tmp_path):
    grey = np.round(127.5 * (1 - primitive(nodes(30)) / 3)).astype(np.uint8)
    np.save(tmp_path / "cell.npy", grey)
    np.savez(tmp_path / "cell.npz", grey=grey)
    voxels = {
        "array": grey,
        "npy": tmp_path / "cell.npy",
        "npz": str(tmp_path / "cell.npz"),
        "slices": list(grey),
        "float32": grey.astype(np.float32),
    }[form]
    surface = voxel_surface(voxels, VoxelReading(level=127.5))
    assert surface.density == pytest.approx(0.5, abs=0.004)
    points = samples(2000)
    value = primitive(points)
    clear = np.abs(value) > 0.05
    np.testing.assert_array_equal((surface.function(points) <= 0)[clear], (value <= 0)[clear])


def test_the_shape_is_a_distance():
    # A ball of radius 0.35 as binary voxels: distance |u - c| - r, to half a voxel.
    grid = nodes(30)
    solid = np.linalg.norm(grid - 0.5, axis=0) <= 0.35
    family = cell_from_voxels(solid, name="ball", resolution=32)
    apart = samples(4000) - 0.5
    away = np.linalg.norm(apart, axis=0)
    middle = (away > 0.1) & (np.abs(apart).max(axis=0) < 0.45)
    error = family.shape(apart + 0.5)[middle] - (away[middle] - 0.35)
    assert np.abs(error).max() < 0.5 / 30
    # The voxels hold the volume of a ball of another radius. Over the 1400 voxels that the surface
    # cuts the error of each, a deviation of 0.0023, averages out; 1 % of the radius is 0.0035.
    radius = np.cbrt(3 * solid.mean() / (4 * np.pi))
    assert np.mean(error) == pytest.approx(0.35 - radius, abs=5e-4)
    assert np.mean(family.shape(samples()) <= 0) == pytest.approx(solid.mean(), abs=5e-4)
    assert (family.symmetry, family.distance, dict(family.parameters)) == ("none", False, {})


def test_level_and_endpoint():
    closed = primitive(nodes(33, 0.0) * 33 / 32)
    with_ends = voxel_surface(-closed, VoxelReading(level=1.0, endpoint=True))
    without_ends = voxel_surface(-primitive(nodes(32)), VoxelReading(level=1.0))
    points = samples(3000)
    for surface in (with_ends, without_ends):
        np.testing.assert_allclose(surface.function(points), primitive(points) + 1, atol=2e-3)
    with pytest.raises(PluginError, match=r"endpoint=True.* along x .*differ by up to"):
        voxel_surface(-primitive(nodes(32) + 0.1), VoxelReading(endpoint=True))
    with pytest.raises(PluginError, match="no voxel boundary at level 5"):
        voxel_surface(-closed, VoxelReading(level=5.0))


@pytest.mark.parametrize(
    ("voxels", "message"),
    [
        (np.zeros((12, 12)), r"shape \(12, 12\), expected \(x, y, z\) with at least 8"),
        (np.zeros((12, 12, 4)), r"shape \(12, 12, 4\)"),
        (np.zeros((12, 12, 12)), "nothing but 0"),
        (np.full((12, 12, 12), np.nan), "1728 values that are not finite"),
        (np.full((9, 9, 9), "a"), "holds <U1"),
        ([np.zeros((9, 9)), np.zeros((9, 8))], "slices differ in shape"),
        (Path("missing.npy"), "missing.npy cannot be read"),
    ],
)
def test_unusable_voxels_are_refused(voxels, message):
    with pytest.raises(PluginError, match=message):
        cell_from_voxels(voxels, name="bad").shape(np.zeros(3))


def test_files_with_objects_or_several_arrays_are_refused(tmp_path):
    np.save(tmp_path / "objects.npy", np.array([{}, 1], dtype=object))
    np.savez(tmp_path / "two.npz", a=np.zeros(3), b=np.zeros(3))
    (tmp_path / "text.npy").write_text("solid")
    for name, message in (
        ("objects", "allow_pickle=False"),
        ("two", "holds the arrays"),
        ("text", "cannot be read as .npy"),
    ):
        path = next(tmp_path.glob(f"{name}.*"))
        with pytest.raises(PluginError, match=message):
            cell_from_voxels(path, name="bad").shape(np.zeros(3))


def test_voxels_that_do_not_repeat_are_refused():
    # A slanted plate: along z it leaves the cell at another place than it enters, so all of both
    # cuts, 0.2 of the face each, differ.
    x, _, z = nodes(30)
    plate = np.abs(x - 0.3 - 0.4 * z) < 0.1
    message = r"repeat along z: .*differ in 40\.0% of the face, .* inside in \d\.\d% at most"
    with pytest.raises(PluginError, match=message):
        voxel_surface(plate)
    assert voxel_surface(plate, VoxelReading(tolerance=0.45)).density == pytest.approx(
        0.2, abs=0.01
    )


def test_a_table_that_loses_material_is_refused():
    x, _, _ = nodes(64)
    sheets = np.sin(2 * np.pi * 8 * x)
    family = cell_from_voxels(sheets, name="fine", reading=VoxelReading(level=0.6), resolution=16)
    with pytest.raises(PluginError, match="give a higher resolution"):
        family.shape(np.zeros(3))


def test_helices_have_their_amplitude_and_meet_at_nodes():
    straight, bent = helices(0.0), helices(0.1)
    points = samples(2000)
    # The straight increment is the strut cell itself: distance to the lines through its nodes.
    corner = np.array(list(product((0.0, 1.0), repeat=3)))
    lines = np.stack([np.full((8, 3), 0.5), corner], axis=1)
    exact = periodic_distance_to_segments(lines)(points)
    np.testing.assert_allclose(periodic_distance_to_segments(straight)(points), exact, atol=1e-12)
    off = periodic_distance_to_segments(lines)(bent.reshape(-1, 3).T)
    assert off.max() == pytest.approx(0.1, abs=1e-6)
    pieces = bent.reshape(8, -1, 2, 3)
    np.testing.assert_allclose(pieces[:, 1:, 0], pieces[:, :-1, 1], atol=1e-15)
    middle = straight.reshape(8, -1, 2, 3)
    np.testing.assert_allclose(pieces[:, [0, -1], [0, 1]], middle[:, [0, -1], [0, 1]], atol=1e-12)


@pytest.mark.slow
def test_grey_selects_increments_exactly():
    family, points = FAMILIES["bcc-straight-to-helix"], samples(40_000)
    for index in (0, 3, COUNT - 1):
        increment = periodic_distance_to_segments(helices(AMPLITUDE * index / (COUNT - 1)))(points)
        value = family.shape(points, grey=255.0 * index / (COUNT - 1))
        for rho in (0.05, 0.3):
            solid = increment <= np.quantile(increment, rho)
            # Both quantiles are counted, here and there, on points of about 1 / 40 000.
            assert np.mean(solid != (value <= rho)) < 2e-3
    # Between two increments, between their cells.
    low, high, mid = (family.shape(points, grey=255.0 * k / 15) for k in (3.0, 4.0, 3.4))
    np.testing.assert_allclose(mid, 0.6 * low + 0.4 * high, atol=1e-12)


@pytest.mark.slow
def test_density_selects_nested_increments():
    family, points = FAMILIES["bcc-triangle-increments"], samples()
    value = family.shape(points)
    for index, voxels in list(enumerate(increments()))[::5]:
        rho = float(voxels.mean())
        # So many evenly spread points count to about 4e-4.
        assert np.mean(value <= rho) == pytest.approx(rho, abs=1e-3)
        # The voxels of the increment, but for those at its surface.
        place = tuple((points * 30).astype(int))
        assert np.mean((value <= rho) != voxels[place]) < 0.05, index


def balls(radius, count=24):
    return np.linalg.norm(nodes(count) - 0.5, axis=0) <= radius


def test_increments_must_contain_each_other():
    thin, thick = balls(0.2), balls(0.4)
    family = cell_from_nested_increments([thick, thin], name="bad")
    # What is lacking is the difference of the volumes, 4/3 pi (0.4^3 - 0.2^3) = 0.235.
    with pytest.raises(PluginError, match=r"increment 1 lacks 2[2-4]\.\d% .*thin to thick"):
        family.shape(np.zeros(3))
    for make in (cell_from_nested_increments, cell_from_increments):
        with pytest.raises(PluginError, match="1 increments, expected 2 or more"):
            make([thin], name="bad")


def test_two_increments_of_ones_own():
    # Half-way in density between balls of 0.2 and 0.4: a ball of the mean volume, about.
    family = cell_from_nested_increments([balls(0.2), balls(0.4)], name="mine")
    mean = float(np.mean([balls(0.2).mean(), balls(0.4).mean()]))
    value = family.shape(samples())
    assert np.mean(value <= balls(0.2).mean()) == pytest.approx(balls(0.2).mean(), abs=0.004)
    inside = np.linalg.norm(samples() - 0.5, axis=0)[value <= mean]
    assert 0.28 < inside.max() < 0.36
    shapes = [partial(lambda k: lambda u: primitive(u) * k, k) for k in (1.0, 7.0)]
    scaled = cell_from_increments(shapes, name="same", grey=77.0)
    # Both are the same cell by different values, so ranks do not change in between.
    assert np.mean(scaled.shape(samples()) <= 0.4) == pytest.approx(0.4, abs=1e-3)
    with pytest.raises(CaseError, match="grey is 256, expected 0 to 255"):
        scaled.shape(samples(9), grey=256.0)


def test_the_stored_cell_is_a_kelvin_cell():
    # Half of the edges' volume by struts alone, 6 sqrt 2 pi r^2 = 0.1706, less overlaps at nodes.
    family = FAMILIES["kelvin-voxel"]
    found = float(np.mean(family.shape(samples(20_000)) <= 0))
    assert 0.14 < found < 0.1706
    # The middle of a strut, between two nodes of the truncated octahedron.
    a, b = np.array([0.5, 0.25, 0.0]), np.array([0.5, 0.0, 0.25])
    assert float(family.shape(0.5 * (a + b))) == pytest.approx(-0.08, abs=0.015)


def test_the_readme_makes_a_cell_of_a_file(tmp_path):
    text = README.read_text(encoding="utf-8")
    code, project = (
        re.search(rf"```{kind}\n(.*?)```", text, re.DOTALL).group(1) for kind in ("python", "toml")
    )
    (tmp_path / "acme_cell.py").write_text(code, encoding="utf-8")
    write_stl(tmp_path / "cell.stl", bars(0.15, 5.0))
    spec = importlib.util.spec_from_file_location("acme_cell", tmp_path / "acme_cell.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (family,) = module.gradedesign_cell_families()
    assert family.name == "acme-cell"
    assert float(family.shape(np.array([0.5, 0.5, 0.0]))) == pytest.approx(-0.15, abs=0.005)
    lines = [line for line in (code + project).splitlines() if line.strip()]
    assert len(lines) <= 20
