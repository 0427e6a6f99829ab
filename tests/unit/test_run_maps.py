"""Cell maps and gradings of a run: homogenised model, walls and bounds."""

from dataclasses import replace

import numpy as np
import pytest
from small_parts import WALLS, box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop.designed import density_grid, with_design
from gradedesign.design.loop.iteration_steps import build_design, explicit_spacing
from gradedesign.design.resolve import resolve_law as law_module
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.oriented import oriented
from gradedesign.design.resolve.solid import solve_solid
from gradedesign.design.resolve.wall_grading import wall_grading
from gradedesign.errors import CaseError, DensityError, LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.lattice import density_at
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.maps.size_law import densities_for_sizes
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.explicit.neighbourhoods import neighbourhood_cells
from gradedesign.mechanics.fe.element_points import element_points
from gradedesign.mechanics.material.bond_matrix import bond_matrix
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.program.host.registry import build_registry

CASE = (
    held_bar(
        box_part(24, 12, 12, 6),
        name="arch",
        material='name = "Ti-6Al-4V"',
        regions='[region.floor]\nplane = "z = min"\n[region.top]\nplane = "z = max"\n',
        load_case="shear",
        force="0 N, 0 N, -400 N",
    )
    + """\
[limits]
safety_factor = 2
[lattice]
cell = "walls"
"""
)
UNEVEN = CellFamily(
    name="uneven", shape=lambda u: np.abs(np.cos(2 * np.pi * u).sum(axis=0)), sides=2
)
LONG = CASE.replace('["24 mm", "12 mm", "12 mm"]', '["60 mm", "20 mm", "20 mm"]').replace(
    'mesh_size = "6 mm"', 'mesh_size = "5 mm"'
)
ARCH = """\
size = "6 mm"
[lattice.cell_map]
kind = "cylindrical"
axis = "+y"
centre = ["12 mm", "0 mm", "-30 mm"]
inner_radius = "30 mm"
around = 38
"""


def law(name="walls-law"):
    return power_law(
        name,
        ("walls",),
        youngs=(1.0, 2.0),
        strength=(1.0, 1.5),
        window=(0.1, 0.9),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )


@pytest.fixture(scope="module")
def registry():
    known = build_registry()
    return replace(
        known,
        cell_families={**known.cell_families, "walls": WALLS, "uneven": UNEVEN},
        scaling_laws={
            **known.scaling_laws,
            "walls-law": law(),
            "uneven-law": replace(law("uneven-law"), families=("uneven",)),
        },
    )


def prepared(folder, text, registry, case=CASE):
    (folder / "case.toml").write_text(case + text)
    return prepare(load_case(folder), registry)


def test_every_tetrahedron_has_the_axes_of_its_cells(tmp_path, registry):
    setup = prepared(tmp_path, ARCH, registry)
    x, _, z = element_points(setup.homogenised.space) - np.reshape([12, 0, -30], (3, 1, 1))
    radius = np.hypot(x, z)
    for k, q in ((0, 0), (17, 2), (40, 3)):
        radial = np.array([x[k, q], 0, z[k, q]]) / radius[k, q]
        across = np.cross([0, 1, 0], radial)
        axes = np.stack([radial, across, [0, 1, 0]], axis=1)
        np.testing.assert_allclose(
            setup.homogenised.rotation[:, :, q, k], bond_matrix(axes), atol=1e-12
        )
    assert any("stretches cells" in w for w in setup.warnings)
    report = setup.cells.layout.report
    assert report["name"] == "cylindrical"
    assert report["size_by_axis"][1]["least"] == pytest.approx(2 * np.pi * 30 / 38, rel=0.01)


def test_walls_are_as_thin_as_their_own_cells(tmp_path, registry):
    text = ARCH + '[print]\nmin_wall = "0.5 mm"\n'
    setup = prepared(tmp_path, text, registry)
    # The narrowest sector, at a radius of 30 mm, is 4.96 mm wide; its walls must be printable.
    least = setup.cells.layout.least
    assert least == pytest.approx(2 * np.pi * 30 / 38, rel=0.01)
    assert setup.cells.bounds[0] == pytest.approx(density_for_wall(calibrate(WALLS), 0.5, least))
    x, _, z = centroids(setup.homogenised.space.mesh) - [[12], [0], [-30]]
    # Dense below and light above, where cells are wider: the thinnest wall is in between.
    rho = np.where(z < 36, 0.5, 0.25)
    grid = density_grid(setup, rho)
    cube = explicit_spacing(setup, grid)
    widest = 2 * np.pi * np.hypot(x, z) / 38
    own = wall_mm(calibrate(WALLS), 0.25, np.minimum(widest, 6.0)[z > 36].min())
    narrowest = wall_mm(calibrate(WALLS), 0.25, least)
    wall = cube * setup.cells.elements_per_wall
    assert wall == pytest.approx(float(own), rel=0.06)
    assert wall > 1.04 * narrowest
    design = build_design(setup.plan.domain, setup.cells, grid)
    assert design.cell_map is setup.cells.layout.cell_map
    assert neighbourhood_cells(design) is setup.cells.layout.cell_map


def test_thick_walls_bear_larger_elements(tmp_path, registry):
    setup = prepared(tmp_path, 'size = "6 mm"\n', registry, LONG)
    plan, x = setup.plan, centroids(setup.homogenised.space.mesh)[0]
    grid = density_grid(setup, np.where(x < 20, 0.2, 0.6))
    spacing = explicit_spacing(setup, grid)
    grading = wall_grading(setup, grid, spacing)
    walls = wall_mm(calibrate(WALLS), np.array([0.2, 0.6]), 6.0)
    at = np.array([[4.0, 52.0], [10.0, 10.0], [10.0, 10.0]])
    np.testing.assert_allclose(grading(at), [1.0, walls[1] / walls[0]], rtol=1e-6)
    # In a thin skin elements stay small.
    skin = Skin(thickness=1.5 * spacing * plan.tools.analysis.elements_per_layer)
    domain = replace(plan.domain, components=(skin,))
    skinned = replace(setup, plan=replace(plan, domain=domain))
    near = np.array([[52.0, 52.0], [10.0, 10.0], [0.5 * skin.thickness, 10.0]])
    found = wall_grading(skinned, grid, spacing)(near)
    np.testing.assert_allclose(found, [1.5, walls[1] / walls[0]], rtol=1e-6)
    # A third of the part is too little to pay.
    grid = density_grid(setup, np.where(x < 40, 0.2, 0.6))
    assert wall_grading(setup, grid, spacing) is None


def test_a_straight_grid_has_one_rotation(tmp_path, registry):
    turned = prepared(
        tmp_path, 'size = "6 mm"\nrotation = ["0 deg", "0 deg", "45 deg"]\n', registry
    )
    c = np.sqrt(0.5)
    axes = np.array([[c, -c, 0], [c, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.homogenised.rotation, bond_matrix(axes), atol=1e-12)
    assert turned.cells.layout.least == turned.cells.layout.typical == 6.0
    assert not any("stretch" in w for w in turned.warnings)


def test_unequal_edges_get_a_law_of_their_own(tmp_path, registry, monkeypatch):
    asked = []

    def compute(cell, poissons_ratio, resolution, edges, *_):
        asked.append((cell.name, poissons_ratio, resolution, edges))
        return law("walls-computed-stretched")

    monkeypatch.setattr(law_module, "computed_law", compute)
    setup = prepared(tmp_path, 'size = ["6 mm", "6 mm", "9 mm"]\n', registry)
    assert asked == [("walls", setup.plan.material.poissons_ratio, 48, (6.0, 6.0, 9.0))]
    assert any("in proportion 1 : 1 : 1.5" in w for w in setup.warnings)
    assert setup.cells.layout.least == 6.0
    # The cell is what was asked for, so nothing is stretched.
    assert setup.cells.layout.report["stretch"]["most"] == pytest.approx(1.0)
    named = prepared(tmp_path, 'size = ["6 mm", "6 mm", "9 mm"]\nlaw = "walls-law"\n', registry)
    assert len(asked) == 1
    assert any("describes cells of equal edges" in w for w in named.warnings)


HUB = ARCH.replace('"-30 mm"]', '"0 mm"]').replace('"30 mm"', '"3 mm"').replace("38", "8")


def test_an_axis_in_the_lattice_is_refused_and_one_in_solid_is_not(tmp_path, registry):
    with pytest.raises(LatticeError, match=r"lattice\.cell_map: the cylindrical .* cannot be used"):
        prepared(tmp_path, HUB, registry)
    kept = HUB + '[[keep]]\nregion = "floor"\nmargin = "4 mm"\n'
    setup = prepared(tmp_path, kept, registry)
    assert np.isfinite(setup.homogenised.rotation).all()
    assert setup.cells.layout.report["folds"] == 0


def test_a_map_that_folds_is_refused(tmp_path, registry):
    text = 'size = "6 mm"\n[lattice.cell_map]\nkind = "conformal"\n'
    with pytest.raises(LatticeError, match=r"lattice\.cell_map: the conformal cell map folds in"):
        prepared(tmp_path, text, registry)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('size = ["4 mm", "8 mm"]\n', "goes with one length"),
        (
            'size = ["4 mm", "8 mm"]\ngrading = "ratio"\n' + ARCH.partition("\n")[2],
            'cell_map: does not go with grading = "ratio"',
        ),
        (
            ARCH.replace("38", '38\npolar_cap = "5 deg"'),
            "polar_cap: has no meaning with the cylindrical",
        ),
        (
            'size = "6 mm"\n[lattice.cell_map]\nkind = "layered"\nlayers = 2\nsurface = "floor"\n'
            'opposite = "tpo"\n',
            'did you mean "top"',
        ),
        ('size = "6 mm"\nwall = "1 mm"\n', 'take grading = "size"'),
        (
            'size = ["4 mm", "8 mm"]\ngrading = "size"\nwall = "1 mm"\n[print]\n'
            'min_wall = "1.2 mm"\n',
            "thinner than the min_wall of 1.2 mm",
        ),
        (
            'size = ["4 mm", "8 mm"]\ngrading = "size"\nwall = "9 mm"\n',
            r"lattice\.wall: walls of 9 mm make cells of 'walls' between",
        ),
    ],
)
def test_impossible_maps_of_a_run_are_refused(tmp_path, registry, text, words):
    with pytest.raises((CaseError, DensityError), match=words):
        prepared(tmp_path, text, registry)


def ramp(setup, low, high):
    """Density of every tetrahedron, from low at x = 10 to high at x = 50 mm."""
    x = centroids(setup.homogenised.space.mesh)[0]
    s = np.clip((x - 10) / 40, 0, 1)
    return low + (high - low) * s * s * (3 - 2 * s)


def graded(folder, registry, text, low, high):
    setup = prepared(folder, text, registry, case=LONG)
    rho = ramp(setup, low, high)
    return setup, with_design(setup, rho), rho


def test_walls_stay_and_sizes_follow(tmp_path, registry):
    # With r = wall / size of the cell, walls of 2 mm ask for 2 / r mm.
    sizes = tuple(2.0 / float(wall_mm(calibrate(WALLS), rho, 1.0)) for rho in (0.5, 0.3))
    text = (
        f'size = ["{sizes[0] - 0.01:.3f} mm", "{sizes[1] + 0.01:.3f} mm"]\n'
        'grading = "size"\nwall = "2 mm"\n'
    )
    setup, made, rho = graded(tmp_path, registry, text, 0.3, 0.5)
    # Nothing is clipped later: the densities that the sizes allow bound sizing.
    assert setup.cells.bounds == pytest.approx((0.3, 0.5), abs=2e-3)
    report = made.cells.layout.report
    assert report["name"] == "graded size"
    assert report["size"]["p5"] == pytest.approx(sizes[0], rel=0.1)
    assert report["size"]["p95"] == pytest.approx(sizes[1], rel=0.1)
    assert report["size_error"]["error"]["p95"] < 0.15
    grid = density_grid(made, rho)
    # The cube follows the wall that the map makes: 2 mm, less what sizes miss by.
    wall = explicit_spacing(made, grid) * setup.cells.elements_per_wall
    assert 1.7 < wall <= 2.0
    points = centroids(setup.homogenised.space.mesh)
    for q in range(4):
        axes = local_cells(
            made.cells.layout.cell_map, element_points(setup.homogenised.space)[:, :, q]
        ).axes
        np.testing.assert_allclose(
            made.homogenised.rotation[:, :, q], bond_matrix(axes), atol=1e-12
        )
    design = build_design(made.plan.domain, made.cells, grid)
    assert design.cell_map is made.cells.layout.cell_map
    # Density stays what sizing chose: the level is set in cell units.
    np.testing.assert_allclose(density_at(design, points), rho, atol=0.02)


def test_size_and_wall_follow_by_the_ratio_rule(tmp_path, registry):
    text = 'size = ["8 mm", "10 mm"]\ngrading = "ratio"\ndensity = [0.3, 0.5]\n'
    setup, made, _ = graded(tmp_path, registry, text, 0.3, 0.5)
    assert setup.cells.bounds == (0.3, 0.5)
    u, points = made.cells.layout.cell_map, np.array([[5.0, 55.0], [10.0, 10.0], [10.0, 10.0]])
    # Dense zones get the small cells; the scale of filters does not move with the design.
    np.testing.assert_allclose(local_cells(u, points).size, [10, 8], rtol=0.04)
    assert made.cells.layout.typical == setup.cells.layout.typical == pytest.approx(np.sqrt(80))
    # The range belongs to the bounds of sizing: half of them uses half of the sizes.
    half = with_design(setup, np.full(setup.homogenised.volumes.size, 0.3))
    np.testing.assert_allclose(local_cells(half.cells.layout.cell_map, points).size, 10, rtol=1e-6)


def test_other_gradings_keep_their_cells(tmp_path, registry):
    text = 'size = "10 mm"\ngrading = "thickness"\n'
    setup, made, _ = graded(tmp_path, registry, text, 0.3, 0.5)
    assert made is setup


def test_thickness_needs_walls_of_one_thickness(tmp_path, registry):
    uneven = LONG.replace('"walls"', '"uneven"')
    text = 'size = "10 mm"\ngrading = "thickness"\n'
    with pytest.raises(CaseError, match=r"lattice\.grading.*'uneven' does not have; take a cell"):
        prepared(tmp_path, text, registry, case=uneven)


def test_sizes_turn_with_the_case(tmp_path, registry):
    text = (
        'size = ["8 mm", "10 mm"]\ngrading = "ratio"\ndensity = [0.3, 0.5]\n'
        'rotation = ["0 deg", "0 deg", "30 deg"]\norigin = ["30 mm", "10 mm", "10 mm"]\n'
    )
    _, made, _ = graded(tmp_path, registry, text, 0.4, 0.4)
    axes = local_cells(made.cells.layout.cell_map, np.array([[7.0], [8.0], [9.0]])).axes[:, :, 0]
    c, s = np.cos(np.pi / 6), 0.5
    np.testing.assert_allclose(axes, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-6)
    corner = made.cells.layout.cell_map(np.array([[30.0], [10.0], [10.0]]))
    np.testing.assert_allclose(corner, 0, atol=1e-9)


def test_densities_of_a_wall():
    # Three sets of walls fill 1 - (1 - 2 t)^3 of the cell, 2 t = wall / size: 0.271 and 0.488.
    low, high = densities_for_sizes(calibrate(WALLS), 1.0, (5.0, 10.0))
    assert (low, high) == pytest.approx((1 - 0.9**3, 1 - 0.8**3), abs=2e-3)
    with pytest.raises(DensityError, match="walls of 1 mm make cells of 'walls' between"):
        densities_for_sizes(calibrate(WALLS), 1.0, (0.5, 0.6))


def test_cells_follow_the_principal_stresses_of_the_solid_part(tmp_path, registry):
    # A block that is sheared between its long faces: principal stresses at 45 degrees.
    block = LONG.replace('fix = [{region = "root"}]', 'fix = [{region = "floor"}]').replace(
        'load = [{region = "tip", force = ["0 N", "0 N", "-400 N"]}]',
        'load = [{region = "top", force = ["400 N", "0 N", "0 N"]}]',
    )
    text = 'size = "5 mm"\n[lattice.orientation]\nload_case = "shear"\n'
    setup = prepared(tmp_path, text, registry, case=block)
    made = oriented(replace(setup, solutions=solve_solid(setup.homogenised)))
    told = made.cells.layout.report["orientation"]
    assert told["straight_angle_degrees"]["p50"] > 35
    assert told["angle_degrees"]["p50"] < 6
    assert told["angle_degrees"]["p95"] < 0.6 * told["straight_angle_degrees"]["p95"]
    assert made.cells.layout.report["folds"] == 0
    for q in range(4):
        axes = local_cells(
            made.cells.layout.cell_map, element_points(setup.homogenised.space)[:, :, q]
        ).axes
        np.testing.assert_allclose(
            made.homogenised.rotation[:, :, q], bond_matrix(axes), atol=1e-12
        )
    assert made.cells.layout.typical == setup.cells.layout.typical
    assert with_design(made, np.full(setup.homogenised.volumes.size, 0.3)) is made


def test_graded_sizes_keep_the_directions(tmp_path, registry):
    text = (
        'size = ["8 mm", "10 mm"]\ngrading = "ratio"\ndensity = [0.3, 0.5]\n'
        '[lattice.orientation]\ndirection = ["1", "1", "0"]\n'
    )
    setup = prepared(tmp_path, text, registry, case=LONG)
    made = with_design(oriented(setup), np.full(setup.homogenised.volumes.size, 0.4))
    axes = local_cells(made.cells.layout.cell_map, np.array([[7.0], [8.0], [9.0]])).axes[:, :, 0]
    assert np.abs(axes[:2, :2]) == pytest.approx(np.sqrt(0.5), abs=0.01)


def test_an_unknown_load_case_to_follow_is_told(tmp_path, registry):
    text = 'size = "8 mm"\n[lattice.orientation]\nload_case = "shaer"\n'
    with pytest.raises(CaseError, match='"shaer" is not defined; did you mean "shear"'):
        prepared(tmp_path, text, registry)
