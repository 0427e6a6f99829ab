"""Cell maps of a run: what the homogenised model, the walls and the bounds make of them."""

from dataclasses import replace

import numpy as np
import pytest

from gradedesign.case.read_case import load_case
from gradedesign.cell.family import CellFamily
from gradedesign.cell.wall_size import density_for_wall, wall_mm
from gradedesign.errors import CaseError, LatticeError
from gradedesign.ladder import resolve_law as law_module
from gradedesign.ladder.round import build_design, density_grid, explicit_cube
from gradedesign.ladder.setup import prepare
from gradedesign.material.power_law import power_law
from gradedesign.mesh.tet_mesh import centroids
from gradedesign.plugin.registry import build_registry
from gradedesign.sizing.homogenised import bond_matrix
from gradedesign.verify.neighbourhoods import neighbourhood_cells

WALLS = CellFamily(
    name="walls",
    shape=lambda u: np.abs(u - np.round(u)).min(axis=0),
    distance=True,
    open_void=False,
)
CASE = """\
[case]
name = "arch"
[part]
box = ["24 mm", "12 mm", "12 mm"]
mesh_size = "6 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[region.floor]
plane = "z = min"
[region.top]
plane = "z = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-400 N"]}]
[limits]
safety_factor = 2
[lattice]
cell = "walls"
"""
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
        name=name, families=("walls",), c1=1.0, n1=2.0, c3=1.0, n3=1.5, window=(0.1, 0.9),
        kind="computed", source="this test", test="none",
    )  # fmt: skip


@pytest.fixture(scope="module")
def registry():
    known = build_registry()
    return replace(
        known,
        cell_families={**known.cell_families, "walls": WALLS},
        scaling_laws={**known.scaling_laws, "walls-law": law()},
    )


def prepared(folder, text, registry):
    (folder / "case.toml").write_text(CASE + text)
    return prepare(load_case(folder), registry)


def test_every_tetrahedron_has_the_axes_of_its_cell(tmp_path, registry):
    setup = prepared(tmp_path, ARCH, registry)
    x, _, z = centroids(setup.space.mesh) - [[12], [0], [-30]]
    radius = np.hypot(x, z)
    for k in (0, 17, 40):
        radial = np.array([x[k], 0, z[k]]) / radius[k]
        across = np.cross([0, 1, 0], radial)
        axes = np.stack([radial, across, [0, 1, 0]], axis=1)
        np.testing.assert_allclose(setup.model.rotation[:, :, k], bond_matrix(axes), atol=1e-12)
    assert any("stretches cells" in w for w in setup.warnings)
    report = setup.layout.report
    assert report["name"] == "cylindrical"
    assert report["size_by_axis"][1]["least"] == pytest.approx(2 * np.pi * 30 / 38, rel=0.01)


def test_walls_are_as_thin_as_their_own_cells(tmp_path, registry):
    text = ARCH + '[print]\nmin_wall = "0.5 mm"\n'
    setup = prepared(tmp_path, text, registry)
    # The narrowest sector, at a radius of 30 mm, is 4.96 mm wide; its walls must be printable.
    least = setup.layout.least
    assert least == pytest.approx(2 * np.pi * 30 / 38, rel=0.01)
    assert setup.bounds[0] == pytest.approx(density_for_wall(WALLS, None, 0.5, least))
    x, _, z = centroids(setup.space.mesh) - [[12], [0], [-30]]
    # Dense below and light above, where cells are wider: the thinnest wall is in between.
    rho = np.where(z < 36, 0.5, 0.25)
    grid = density_grid(setup, rho)
    cube = explicit_cube(setup, grid)
    widest = 2 * np.pi * np.hypot(x, z) / 38
    own = wall_mm(WALLS, None, 0.25, np.minimum(widest, 6.0)[z > 36].min())
    narrowest = wall_mm(WALLS, None, 0.25, least)
    wall = cube * setup.case.run.mesh_cubes_per_wall
    assert wall == pytest.approx(float(own), rel=0.06)
    assert wall > 1.04 * narrowest
    design = build_design(setup, grid)
    assert design.cell_map is setup.layout.cell_map
    assert neighbourhood_cells(design) is setup.layout.cell_map


def test_a_straight_grid_has_one_rotation(tmp_path, registry):
    turned = prepared(
        tmp_path, 'size = "6 mm"\nrotation = ["0 deg", "0 deg", "45 deg"]\n', registry
    )
    c = np.sqrt(0.5)
    axes = np.array([[c, -c, 0], [c, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.model.rotation, bond_matrix(axes), atol=1e-12)
    assert turned.layout.least == turned.layout.typical == 6.0
    assert not any("stretch" in w for w in turned.warnings)


def test_unequal_edges_get_a_law_of_their_own(tmp_path, registry, monkeypatch):
    asked = []

    def compute(family, parameters, edges):
        asked.append((family.name, edges))
        return law("walls-computed-stretched")

    monkeypatch.setattr(law_module, "computed_law", compute)
    setup = prepared(tmp_path, 'size = ["6 mm", "6 mm", "9 mm"]\n', registry)
    assert asked == [("walls", (6.0, 6.0, 9.0))]
    assert any("in proportion 1 : 1 : 1.5" in w for w in setup.warnings)
    assert setup.layout.least == 6.0
    # The cell is what was asked for, so nothing is stretched.
    assert setup.layout.report["stretch"]["most"] == pytest.approx(1.0)
    named = prepared(tmp_path, 'size = ["6 mm", "6 mm", "9 mm"]\nlaw = "walls-law"\n', registry)
    assert len(asked) == 1
    assert any("describes cells of equal edges" in w for w in named.warnings)


HUB = ARCH.replace('"-30 mm"]', '"0 mm"]').replace('"30 mm"', '"3 mm"').replace("38", "8")


def test_an_axis_in_the_lattice_is_refused_and_one_in_solid_is_not(tmp_path, registry):
    with pytest.raises(LatticeError, match=r"lattice\.cell_map: the cylindrical .* cannot be used"):
        prepared(tmp_path, HUB, registry)
    kept = HUB + '[[keep]]\nregion = "floor"\nmargin = "4 mm"\n'
    setup = prepared(tmp_path, kept, registry)
    assert np.isfinite(setup.model.rotation).all()
    assert setup.layout.report["folds"] == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('size = ["4 mm", "8 mm"]\n', "not there yet"),
        (
            ARCH.replace("38", '38\npolar_cap = "5 deg"'),
            "polar_cap: has no meaning with the cylindrical",
        ),
        (
            'size = "6 mm"\n[lattice.cell_map]\nkind = "layered"\nlayers = 2\nsurface = "floor"\n'
            'opposite = "tpo"\n',
            'did you mean "top"',
        ),
        ('size = "6 mm"\nwall = "1 mm"\n', "belongs to `gradedesign generate`"),
    ],
)
def test_impossible_maps_of_a_run_are_refused(tmp_path, registry, text, words):
    with pytest.raises(CaseError, match=words):
        prepared(tmp_path, text, registry)
