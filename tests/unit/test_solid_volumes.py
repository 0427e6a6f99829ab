"""Passive solids by volume: box, cylinder, body; what check says, what generate makes of them."""

import json

import numpy as np
import pytest
from composed_domains import design_domain
from scipy.spatial import cKDTree
from small_parts import SHORT_BAR

from gradedesign.design.case.read_case import load_case
from gradedesign.design.check.check_case import check_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.errors import CaseError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.zone import Zones
from gradedesign.geometry.lattice.domain import KEPT, grown, phase_at
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.program.commands.check_data import kept_solids
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs import drawn_files
from gradedesign.program.pictures.marks import region_marks

READERS = {".stl": read_stl}
CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-200 N"]}]
[limits]
stress = "100 MPa"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.4, 0.6]
"""
)
ENDS = CASE[CASE.index("[[keep]]") : CASE.index("[[load_case]]")]
BOX = 'box = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["5 mm", "8 mm", "8 mm"]}'
PIN = 'cylinder = {diameter = "4 mm", ends = [["8 mm", "4 mm", "-9 mm"], ["8 mm", "4 mm", "6 mm"]]}'
ROD = 'cylinder = {diameter = "4 mm", point = ["8 mm", "0 mm", "4 mm"], axis = "+y"}'
LYING = (
    'cylinder = {diameter = "2 mm", ends = [["2 mm", "2 mm", "4 mm"], ["5 mm", "6 mm", "4 mm"]]}'
)


def moved(surface, x, y, z):
    return SurfaceMesh(vertices=surface.vertices + np.array([x, y, z]), faces=surface.faces)


def together(*surfaces):
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces)])
    return SurfaceMesh(
        vertices=np.concatenate([s.vertices for s in surfaces]),
        faces=np.concatenate([s.faces + n for s, n in zip(surfaces, starts, strict=False)]),
    )


def written(folder, keep, case=CASE):
    (folder / "case.toml").write_text(case.replace(ENDS, f"[[keep]]\n{keep}\n"), encoding="utf-8")
    return folder


def domain_of(folder, keep, case=CASE):
    read = load_case(written(folder, keep, case))
    part = part_of(read, READERS)
    return read, part, design_domain(read, part)


def kept_volume(domain, count=96):
    edges = domain.upper - domain.lower
    shares = (np.indices((count,) * 3).reshape(3, -1) + 0.5) / count
    points = domain.lower[:, None] + shares * edges[:, None]
    kept = (phase_at(domain, points) == KEPT) & (domain.distance(points) < 0)
    return float(kept.mean() * edges.prod())


@pytest.mark.parametrize(
    ("keep", "volume", "thickness"),
    [
        (BOX, 5 * 8 * 8, 5.0),
        (f'{BOX}\nmargin = "1 mm"', 6 * 8 * 8, 6.0),
        # It begins outside the part; 6 mm of it lie inside.
        (PIN, np.pi * 4 * 6, 4.0),
        (ROD, np.pi * 4 * 8, 4.0),
        (LYING, np.pi * 5, 2.0),
        ('body = {file = "insert.stl", units = "mm"}', 3 * 4 * 4, 3.0),
    ],
    ids=["box", "grown", "pin", "rod", "lying", "file"],
)
def test_a_volume_is_solid_in_the_part(tmp_path, keep, volume, thickness):
    """Volumes in closed form; that of 96^3 samples of the part is right within 1 %."""
    write_stl(tmp_path / "insert.stl", moved(box_surface((3.0, 4.0, 4.0)), 6.5, 2.0, 2.0))
    _, _, domain = domain_of(tmp_path, keep)
    assert kept_volume(domain) == pytest.approx(volume, rel=0.01)
    # The largest ball of 15^3 samples along the box of a lying cylinder is 8 % too small.
    assert domain.layers == pytest.approx([thickness], rel=0.1)
    assert domain.layers[0] <= thickness * 1.001


def test_distances_to_volumes_are_exact(tmp_path):
    """Against closest points of a cylinder's outline, sampled densely."""
    _, _, domain = domain_of(tmp_path, LYING)
    first, second = np.array([2.0, 2.0, 4.0]), np.array([5.0, 6.0, 4.0])
    axis, side, up = (second - first) / 5.0, np.array([-0.8, 0.6, 0.0]), np.array([0.0, 0.0, 1.0])
    t, angle = np.linspace(0, 5, 501), np.linspace(0, 2 * np.pi, 721)
    ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up
    wall = first + t[:, None, None] * axis + ring
    ends = first + np.array([0.0, 5.0])[:, None, None, None] * axis
    ends = ends + np.linspace(0, 1, 101)[:, None, None] * ring
    outline = np.concatenate([wall.reshape(-1, 3), ends.reshape(-1, 3)])
    points = np.random.default_rng(7).uniform(-1, 9, (3, 60))
    found = domain.of(PassiveRegion)[0].to_place(points)
    nearest, _ = cKDTree(outline).query(points.T)
    np.testing.assert_allclose(np.abs(found), nearest, atol=0.01)
    apart = points.T - first
    along = apart @ axis
    inside = (along > 0) & (along < 5) & (np.linalg.norm(apart - along[:, None] * axis, axis=1) < 1)
    np.testing.assert_array_equal(found < 0, inside)


def test_a_volume_flush_with_the_part_ends_at_its_faces(tmp_path):
    """Printed surfaces are contoured a little beyond the part, and what is solid is solid there."""
    _, _, domain = domain_of(tmp_path, BOX)
    for band in (None, 0.5):
        _, (layer,) = solid_layers(grown(domain, 0.4), band)
        points = np.array([[-0.3, 2.5, 4.5, 5.5], [4.0, 8.3, -0.3, -0.3], [4.0, 4.0, 4.0, 4.0]])
        values = layer(points, grown(domain, 0.4).distance(points))
        assert (values[:3] < 0).all()
        assert values[3] > -0.2
        inside = np.array([[4.0, 6.0], [4.0, 4.0], [4.0, 4.0]])
        known = grown(domain, 0.4).distance(inside)
        np.testing.assert_allclose(layer(inside, known)[0], -1.0, atol=1e-4)
        assert layer(inside, known)[1] > 0.4


def test_one_of_several_bodies_stays_solid_with_its_void(tmp_path):
    hollow = box_surface((8.0, 8.0, 8.0))
    void = moved(box_surface((4.0, 4.0, 4.0)), 2.0, 2.0, 2.0)
    void = SurfaceMesh(vertices=void.vertices, faces=void.faces[:, ::-1])
    bar = moved(box_surface((16.0, 8.0, 8.0)), 0.0, 10.0, 0.0)
    write_stl(tmp_path / "two.stl", together(hollow, void, bar))
    case = CASE.replace(
        'box = ["16 mm", "8 mm", "8 mm"]', 'file = "two.stl"\nunits = "mm"\nbodies = "all"'
    ).replace("[material]", '[region.lid]\nplane = "z = 6 mm"\n[material]')
    read, part, domain = domain_of(tmp_path, 'body = {region = "lid"}', case)
    # The region is a face of the void.
    assert kept_volume(domain) == pytest.approx(8**3 - 4**3, rel=0.02)
    assert enclosed_volume(part.bodies[read.keep[0].body]) == pytest.approx(8**3 - 4**3)
    with pytest.raises(CaseError, match=r"keep\[0\]\.body\.region: .* all 2 bodies of the part"):
        domain_of(tmp_path, 'body = {region = "root"}', case)


def test_a_body_is_a_place_of_a_zone_too(tmp_path):
    write_stl(tmp_path / "insert.stl", moved(box_surface((8.0, 8.0, 8.0)), 4.0, 0.0, 0.0))
    zone = '[[zone]]\nbody = {file = "insert.stl", units = "mm"}\ndensity = [0.5, 0.6]\n'
    _, _, domain = domain_of(tmp_path, BOX, CASE + zone + 'transition = "4 mm"\n')
    points = np.array([[8.0, 4.0, 1.0], [4.0, 4.0, 4.0], [4.0, 4.0, 4.0]])
    weights = domain.of(Zones)[0].weights(points)
    np.testing.assert_allclose(weights[1], [1.0, 0.5, 0.0], atol=1e-9)


def test_the_identity_of_a_case_holds_the_bytes_of_its_bodies(tmp_path):
    hashes = []
    for edge in (3.0, 3.0, 4.0):
        write_stl(tmp_path / "insert.stl", moved(box_surface((edge, 4.0, 4.0)), 6.0, 2.0, 2.0))
        keep = 'body = {file = "insert.stl", units = "mm"}'
        hashes.append(load_case(written(tmp_path, keep)).case_hash)
    assert hashes[0] == hashes[1] != hashes[2]
    (tmp_path / "copy").mkdir()
    write_stl(tmp_path / "copy/insert.stl", moved(box_surface((4.0, 4.0, 4.0)), 6.0, 2.0, 2.0))
    assert load_case(written(tmp_path / "copy", keep)).case_hash == hashes[2]


def test_check_says_which_volume_sets_the_grid_and_draws_it(tmp_path):
    thin = 'name = "plate"\n' + BOX.replace("5 mm", "0.4 mm")
    case = load_case(written(tmp_path, thin))
    found = check_case(case, build_registry())
    assert "the passive solid 'plate', 0.4 mm" in found.run.grid.set_by
    known = found.plan
    (mark,) = (
        m for m in region_marks(case.load_case, known.part, known.domain) if m.role == "passive"
    )
    assert mark.name == "plate"
    # 0.04 mm, a tenth of its thickness, below the faces.
    np.testing.assert_allclose(mark.corners.min(axis=(0, 1)), [0.04, 0.04, 0.04], atol=0.01)
    np.testing.assert_allclose(mark.corners.max(axis=(0, 1)), [0.36, 7.96, 7.96], atol=0.01)
    (solid,) = kept_solids(found)
    assert solid["name"] == "'plate'"
    assert solid["volume_mm3"] == pytest.approx(0.4 * 64, rel=1e-4)


@pytest.mark.parametrize(
    ("keep", "exact", "error"),
    [
        # What fills its box is exact, but for the millionth of the diagonal that volumes reach on.
        (BOX, 5 * 8 * 8, 1e-5),
        ('region = "root"\nmargin = "1.3 mm"', 1.3 * 8 * 8, 1e-9),
        # Of 40,000 random points in their boxes one standard deviation would be 0.3 and 0.8 %.
        (PIN, np.pi * 2**2 * 6, 2e-3),
        (ROD, np.pi * 2**2 * 8, 2e-3),
        (LYING, np.pi * 1**2 * 5, 4e-3),
    ],
    ids=["box", "region", "pin", "rod", "lying"],
)
def test_check_states_how_much_stays_solid(tmp_path, keep, exact, error):
    (solid,) = kept_solids(check_case(load_case(written(tmp_path, keep)), build_registry()))
    assert solid["volume_mm3"] == pytest.approx(exact, rel=error)


def test_finite_cells_lay_their_grid_on_faces_of_a_box_in_the_part(tmp_path):
    box = 'box = {lower = ["-9 mm", "-9 mm", "-9 mm"], upper = ["5 mm", "9 mm", "9 mm"]}'
    _, _, domain = domain_of(tmp_path, f'{box}\nmargin = "0.5 mm"')
    assert domain.solids[0].planes == ((0, 5.5, 64.0),)


def test_generate_prints_a_flush_volume_solid(tmp_path, cli, monkeypatch):
    monkeypatch.setattr(drawn_files, "picture_lattice", lambda *_, **__: ())
    (tmp_path / "case.toml").write_text(
        '[case]\nname = "flush"\n[part]\nbox = ["12 mm", "4 mm", "4 mm"]\n[lattice]\n'
        'cell = "gyroid-sheet"\nsize = "4 mm"\ndensity = 0.3\n'
        '[[keep]]\nbox = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["4 mm", "4 mm", "4 mm"]}\n',
        encoding="utf-8",
    )
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    measures = json.loads((tmp_path / "out" / "result.json").read_text())["measures"]
    slabs = measures["density"]["slabs"]["x"]
    np.testing.assert_allclose(slabs["surface"], [1.0, 0.3, 0.3], atol=0.005)
    assert slabs["surface"][0] == pytest.approx(1.0, abs=1e-6)
    assert measures["volume_mm3"] == pytest.approx(64 + 0.3 * 128, rel=0.01)


@pytest.mark.parametrize(
    ("keep", "message"),
    [
        ('margin = "2 mm"', "found none; expected exactly one of region, box, cylinder, body"),
        (f'region = "root"\n{BOX}', "found region and box; expected exactly one of"),
        ('region = "root"', r"keep\[0\]\.margin: is needed with region"),
        ('region = "root"\nmargin = "0 mm"', "is needed with region"),
        ('cylinder = {diameter = "4 mm"}', "found neither of ends and point"),
        (
            'cylinder = {diameter = "4 mm", ends = [["0 mm", "0 mm", "0 mm"]]}',
            "expected the middles of both ends",
        ),
        (
            PIN.replace("-9 mm", "6 mm"),
            "twice the same point",
        ),
        (PIN.replace("}", ', axis = "+z"}'), r"axis: has no meaning with ends"),
        ("body = {}", "found neither of region and file"),
        ('body = {region = "rot"}', 'region "rot" is not defined'),
        ('body = {file = "gone.stl"}', "does not exist"),
        ('body = {file = "case.toml", units = "mm"}', "body.file: found case.toml, which no"),
        ('body = {region = "root"}', "all 1 bodies of the part"),
        (BOX.replace("0 mm", "90 mm").replace("5 mm", "95 mm"), "upper: found y = 8 mm"),
        (
            ROD.replace('"8 mm", "0 mm", "4 mm"', '"80 mm", "0 mm", "4 mm"'),
            r"keep\[0\]\.cylinder: no place of the part was found in it; .* \(16, 8, 8\) mm",
        ),
    ],
)  # fmt: skip
def test_what_a_volume_cannot_be_is_named(tmp_path, keep, message):
    with pytest.raises(CaseError, match=message):
        domain_of(tmp_path, keep)


def test_a_volume_that_fills_the_part_is_refused(tmp_path):
    keep = BOX.replace("0 mm", "-9 mm").replace('"5 mm"', '"99 mm"').replace('"8 mm"', '"9 mm"')
    case = load_case(written(tmp_path, keep))
    with pytest.raises(CaseError, match=r"keep\[0\]\.box: holds the whole part"):
        check_case(case, build_registry())
