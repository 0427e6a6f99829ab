"""Cell maps of a case: each kind with its sizes, reported, and refused where it cannot be."""

import meshio
import numpy as np
import pytest
from composed_domains import design_domain
from small_parts import WALLS

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.stated_density import stated_density
from gradedesign.design.resolve.stated_lattice import stated_layout
from gradedesign.errors import CaseError, DensityError, LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.program.host.registry import build_registry

REGISTRY = build_registry()
CASE = """\
[case]
name = "maps"
[part]
box = ["60 mm", "20 mm", "20 mm"]
[region.floor]
plane = "z = min"
[lattice]
cell = "walls"
"""


def mapped(folder, text, family=WALLS):
    (folder / "case.toml").write_text(CASE + text)
    case = load_case(folder)
    part = part_of(case, {})
    domain = design_domain(case, part)
    calibration = calibrate(family)
    density = stated_density(
        case,
        REGISTRY,
        None,
        domain=domain,
        window=calibration.window,
        level_of=calibration.level_of,
    )
    layout = stated_layout(case, REGISTRY, part, calibration, density, domain)
    return layout.cell_map, layout.report


def test_a_straight_grid_has_one_size_and_no_shear(tmp_path):
    cell_map, report = mapped(tmp_path, 'size = "10 mm"\ndensity = 0.3\n')
    assert cell_map.size == pytest.approx(10)
    assert report["size"]["least"] == pytest.approx(10)
    assert report["size"]["most"] == pytest.approx(10)
    assert report["shear"]["most"] == pytest.approx(0, abs=1e-6)
    assert report["folds"] == 0


def test_cells_about_an_axis_are_as_wide_as_the_turn_allows(tmp_path):
    text = """\
size = "10 mm"
density = 0.3
[lattice.cell_map]
kind = "cylindrical"
axis = "+x"
centre = ["0 mm", "10 mm", "-40 mm"]
inner_radius = "40 mm"
around = 30
"""
    _, report = mapped(tmp_path, text)
    # By hand: the part lies at radii 40 to hypot(60, 10) mm; a cell is 2 pi r / 30 wide.
    turn = report["size_by_axis"][1]
    assert turn["least"] == pytest.approx(2 * np.pi * 40 / 30, rel=0.01)
    assert turn["most"] == pytest.approx(2 * np.pi * np.hypot(60, 10) / 30, rel=0.01)
    assert report["shear"]["most"] == pytest.approx(0, abs=1e-6)


def test_cells_about_a_centre_are_refused_near_it(tmp_path):
    text = """\
size = "5 mm"
density = 0.3
[lattice.cell_map]
kind = "spherical"
centre = ["30 mm", "10 mm", "10 mm"]
inner_radius = "5 mm"
around = 24
"""
    with pytest.raises(LatticeError, match=r"lattice\.cell_map: the spherical cell map cannot"):
        mapped(tmp_path, text)
    far = text.replace('"10 mm", "10 mm"]', '"10 mm", "-90 mm"]').replace('"5 mm"\na', '"90 mm"\na')
    _, report = mapped(tmp_path, far.replace('"spherical"', '"spherical"\naxis = "+x"'))
    assert report["folds"] == 0


def test_layers_count_from_a_region(tmp_path):
    text = """\
size = "5 mm"
density = 0.3
[lattice.cell_map]
kind = "conformal"
surface = "floor"
"""
    cell_map, report = mapped(tmp_path, text)
    u = cell_map(np.array([[7.0], [8.0], [12.5]]))
    np.testing.assert_allclose(u[:, 0], [1.4, 1.6, 2.5])
    assert report["shear"]["p95"] == pytest.approx(0, abs=1e-6)


def test_whole_layers_fit_between_two_regions(tmp_path):
    text = """\
size = ["5 mm", "6 mm", "1 mm"]
density = 0.3
[lattice.cell_map]
kind = "layered"
layers = 3
surface = "floor"
opposite = "top"
[region.top]
plane = "z = max"
"""
    cell_map, report = mapped(tmp_path, text)
    u = cell_map(np.array([[7.0, 7.0], [9.0, 9.0], [20.0, 10.0]]))
    np.testing.assert_allclose(u, [[1.4, 1.4], [1.5, 1.5], [3.0, 1.5]], atol=1e-12)
    assert report["size_by_axis"][2]["p50"] == pytest.approx(20 / 3)


def test_three_edges_make_cells_that_are_no_cubes(tmp_path):
    text = 'size = ["5 mm", "6 mm", "8 mm"]\norigin = ["1 mm", "0 mm", "0 mm"]\ndensity = 0.3\n'
    cell_map, report = mapped(tmp_path, text)
    np.testing.assert_allclose(cell_map(np.array([[6.0], [3.0], [2.0]]))[:, 0], [1, 0.5, 0.25])
    assert [s["p50"] for s in report["size_by_axis"]] == pytest.approx([5, 6, 8])


def test_a_warp_magnifies_its_middle(tmp_path):
    text = """\
size = "5 mm"
density = 0.3
[[lattice.warp]]
centre = ["30 mm", "10 mm", "10 mm"]
stable_radius = "4 mm"
outer_radius = "9 mm"
magnification = 1.2
"""
    cell_map, report = mapped(tmp_path, text)
    slope = cell_map.jacobian(np.array([[30.5], [10.5], [10.5]]))[:, :, 0]
    np.testing.assert_allclose(1 / np.linalg.norm(slope, axis=1), 6.0)
    assert report["folds"] == 0


RAMP = '[lattice.density_map]\nformula = "0.3 + 0.2 * smoothstep(10, 50, x)"\n'


def test_size_follows_the_density_of_walls_of_one_thickness(tmp_path):
    small, large = (2 / (2 * float(calibrate(WALLS).level_of(rho))) for rho in (0.5, 0.3))
    sizes = f'size = ["{0.99 * small:.3f} mm", "{1.01 * large:.3f} mm"]\n'
    _, report = mapped(tmp_path, f'{sizes}grading = "size"\nwall = "2 mm"\n{RAMP}')
    assert report["size"]["p5"] == pytest.approx(small, rel=0.1)
    assert report["size"]["p95"] == pytest.approx(large, rel=0.1)
    assert report["size_error"]["error"]["p95"] < 0.15
    assert report["folds"] == 0
    with pytest.raises(DensityError, match=r"walls of 3 mm need cells of"):
        mapped(tmp_path, f'{sizes}grading = "size"\nwall = "3 mm"\n{RAMP}')


def test_size_and_wall_change_by_the_ratio_rule(tmp_path):
    text = f'size = ["8 mm", "10 mm"]\ngrading = "ratio"\n{RAMP}'
    _, report = mapped(tmp_path, text)
    # Dense zones get the small cells.
    assert report["size"]["p5"] == pytest.approx(8, rel=0.05)
    assert report["size"]["p95"] == pytest.approx(10, rel=0.05)


AROUND = """\
size = "5 mm"
density = 0.3
[lattice.orientation]
"""


def about_an_axis(points):
    """Unit directions around the axis x = 30, y = -40."""
    x, y = points[0] - 30, points[1] + 40
    return np.stack([y, -x, 0 * x]) / np.hypot(x, y)


def require_followed(report):
    # By hand: over the box directions turn by atan(30 / 40) = 37 degrees to both sides; cells in a
    # ring of radii 40 to 60 mm around an axis cannot all be equally wide.
    told = report["orientation"]
    assert told["straight_angle_degrees"]["p95"] > 30
    # Directions and equal sizes contradict each other, and least squares give to both.
    assert told["angle_degrees"]["p95"] < 0.2 * told["straight_angle_degrees"]["p95"]
    assert told["angle_degrees"]["p50"] < 3
    assert report["folds"] == 0
    assert report["shear"]["p95"] < 10
    assert 0.05 < report["size_error"]["error"]["p95"] < 0.35


def test_cells_follow_the_directions_of_a_formula(tmp_path):
    text = 'direction = ["(y + 40) / sqrt((x - 30)^2 + (y + 40)^2)", '
    text += '"(30 - x) / sqrt((x - 30)^2 + (y + 40)^2)", "0"]\n'
    cell_map, report = mapped(tmp_path, AROUND + text)
    assert cell_map.name == "graded size"
    require_followed(report)


def test_a_map_that_folds_is_refused(tmp_path):
    # Layers count from all faces: in the upper half they come back, against the normal.
    text = 'size = "5 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "conformal"\n'
    words = r"lattice\.cell_map: the conformal cell map folds in [5-9]\d.* %"
    with pytest.raises(LatticeError, match=words):
        mapped(tmp_path, text)


@pytest.mark.parametrize("kind", ["tensor", "symmetric", "direction"])
def test_cells_follow_a_field_from_outside(tmp_path, kind):
    mesh = box_part_mesh((60.0, 20.0, 20.0), 4.0)
    along = about_an_axis(centroids(mesh))
    # Tension of 7 around and pressure of 2 along the axis, MPa.
    stress = 7 * along[:, None] * along[None]
    stress[2, 2] -= 2
    values = {
        "tensor": np.moveaxis(stress, -1, 0).reshape(-1, 9),
        "symmetric": stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]].T,
        "direction": along.T,
    }[kind]
    cells = [("tetra", mesh.tets.T)]
    meshio.Mesh(mesh.points.T, cells, cell_data={"pull": [values]}).write(tmp_path / "pull.vtu")
    _, report = mapped(tmp_path, AROUND + 'vtu = "pull.vtu"\n')
    require_followed(report)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected exactly one of load_case, direction, vtu"),
        ('direction = ["1", "0"]', "expected three entries"),
        ('direction = ["1", "0", "w"]', "unknown name"),
        ('direction = ["0", "0", "0"]', "zero nearly everywhere"),
        ('load_case = "pull"', "needs the stress of an analysis"),
        ('vtu = "nothing.vtu"', "does not exist"),
        ('direction = ["1", "0", "0"]\nfield = "a"', "field: belongs to vtu"),
        (
            'direction = ["1", "0", "0"]\n[lattice.cell_map]\nkind = "conformal"\n',
            r"cell_map: does not go with \[lattice.orientation\]",
        ),
    ],
)
def test_impossible_directions_are_refused(tmp_path, text, words):
    with pytest.raises(CaseError, match=words):
        mapped(tmp_path, AROUND + text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('size = ["8 mm", "10 mm"]\ndensity = 0.3\n', "goes with one length"),
        ('size = ["8 mm", "9 mm", "9 mm", "8 mm"]\ndensity = 0.3\n', "or three edges"),
        (
            'size = ["8 mm", "9 mm", "9 mm"]\ndensity = 0.3\n[lattice.cell_map]\n'
            'kind = "cylindrical"\naround = 9\ninner_radius = "9 mm"\n',
            "sets the width of its cells by around",
        ),
        (
            'size = "8 mm"\nrotation = ["5 deg", "0 deg", "0 deg"]\ndensity = 0.3\n'
            '[lattice.cell_map]\nkind = "conformal"\n',
            "rotation: has no meaning with the conformal",
        ),
        (
            'size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "layered"\n'
            'surface = "floor"\nopposite = "floor"\n',
            "a layered map needs layers",
        ),
        (
            'size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "layered"\nlayers = 3\n'
            'surface = "floor"\nopposite = "cieling"\n',
            'region "cieling" is not defined',
        ),
        (f'size = "8 mm"\ngrading = "ratio"\n{RAMP}', "goes with a range"),
        (f'size = ["8 mm", "10 mm"]\ngrading = "size"\n{RAMP}', "wall: missing; .*add wall"),
        ('size = ["8 mm", "10 mm"]\ngrading = "ratio"\ndensity = 0.3\n', "needs .*density_map"),
        ('size = ["10 mm", "8 mm"]\ndensity = 0.3\n', "smallest size first"),
        ('size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "conical"\n', "cylindrical"),
        (
            'size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "cylindrical"\n',
            "needs around",
        ),
        (
            'size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "conformal"\naround = 9\n',
            "no meaning with the conformal",
        ),
        (
            'size = "8 mm"\ndensity = 0.3\n[lattice.cell_map]\nkind = "conformal"\n'
            'surface = "flor"\n',
            'did you mean "floor"',
        ),
    ],
)
def test_gradings_that_contradict_themselves_are_refused(tmp_path, text, words):
    with pytest.raises(CaseError, match=words):
        mapped(tmp_path, text)


def test_thickness_needs_walls_of_one_thickness(tmp_path):
    text = 'size = "10 mm"\ndensity = 0.3\ngrading = "thickness"\n'
    mapped(tmp_path, text)
    uneven = CellFamily(name="uneven", shape=lambda u: np.abs(np.cos(2 * np.pi * u).sum(axis=0)))
    with pytest.raises(CaseError, match=r"lattice\.grading.*walls of one thickness"):
        mapped(tmp_path, text, family=uneven)
