"""The part's own triangles kept, the internal surface appended: key, file, what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.formats.write_stl import surface_of_stl, write_stl
from gradedesign.geometry.lattice.components.drain import Drain
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.printed_surface import surface_behind_skin
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    open_edge_count,
)
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

EDGES = (12.0, 8.0, 8.0)
CASE = """\
[case]
name = "hollow"
[part]
file = "part.stl"
units = "{units}"
[region.left]
plane = "x = min"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = 0.3
{lattice}
[print]
outer = "{outer}"
{printed}
[output]
formats = ["stl", "ply"]
"""
SKIN = 'skin = "1.5 mm"'


def part_file(folder, scale=1.0):
    """A box in the byte layout of another program: normals of zero, colours, a negative zero."""
    path = folder / "part.stl"
    write_stl(path, box_surface(tuple(scale * edge for edge in EDGES)))
    data = bytearray(path.read_bytes())
    records = np.frombuffer(data, dtype=np.uint8, offset=84).reshape(-1, 50).copy()
    records[:, :12] = 0
    records[:, 48] = 1 + np.arange(len(records))
    numbers = records[:, 12:48].copy().view("<f4")
    numbers[numbers == 0] = -0.0
    records[:, 12:48] = numbers.view(np.uint8)
    path.write_bytes(bytes(data[:84]) + records.tobytes())
    return path


def made(folder, lattice=SKIN, outer="cad", printed="", units="mm"):
    folder.mkdir(exist_ok=True)
    part_file(folder, 0.1 if units == "cm" else 1.0)
    text = CASE.format(lattice=lattice, outer=outer, printed=printed, units=units)
    (folder / "case.toml").write_text(text)
    case = load_case(folder)
    return run(case, build_registry(), folder=folder / "out")


def written(folder):
    return surface_of_stl((folder / "out" / "lattice.stl").read_bytes(), "lattice.stl")


def internal(surface, count):
    return SurfaceMesh(vertices=surface.vertices, faces=surface.faces[count:])


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Folder and result of the plain case."""
    folder = tmp_path_factory.mktemp("kept")
    return folder, made(folder)


def test_triangles_of_the_part_are_in_the_file_byte_for_byte(kept):
    folder, result = kept
    given = (folder / "part.stl").read_bytes()[84:]
    assert (folder / "out" / "lattice.stl").read_bytes()[84:].startswith(given)
    assert result.printed["outer"] == {"triangles": len(given) // 50, "kept": "bytes"}
    stored = json.loads((folder / "out" / "result.json").read_text())
    assert stored["printed"]["outer"]["kept"] == "bytes"


def test_internal_surface_is_closed_inverted_and_nowhere_near_the_outer_one(kept):
    folder, result = kept
    surface = written(folder)
    inner = internal(surface, 12)
    assert open_edge_count(surface) == 0
    depth = -surface_distance(box_surface(EDGES))(inner.vertices[inner.faces].reshape(-1, 3).T)
    # The skin of 1.5 mm, single precision.
    assert depth.min() == pytest.approx(1.5, abs=2e-3)
    assert not len(crossing_triangles(surface.vertices, surface.faces, TOUCHING))
    cavities = -enclosed_volume(inner)
    assert cavities > 0
    assert result.measures["volume_mm3"] == pytest.approx(np.prod(EDGES) - cavities, rel=1e-6)
    assert not [w for w in result.warnings if "pass through" in w]


def test_solid_is_that_of_the_cut_surface(kept, tmp_path):
    """The lattice is the same, and so is its volume; 0.1 % are the inner edges of the skin."""
    cut = made(tmp_path, outer="cut")
    assert kept[1].measures["volume_mm3"] == pytest.approx(cut.measures["volume_mm3"], rel=1e-3)
    assert "outer" not in cut.printed


def test_other_units_keep_values_and_say_so(tmp_path):
    result = made(tmp_path, units="cm")
    assert result.printed["outer"] == {"triangles": 12, "kept": "values"}
    surface, part = written(tmp_path), box_surface(EDGES)
    given = np.float32(0.1 * part.vertices[part.faces]).astype(np.float64)
    corners = surface.vertices[surface.faces[:12]]
    np.testing.assert_array_equal(corners, np.float32(10.0 * given))


def test_solid_regions_have_no_internal_surface(tmp_path):
    made(tmp_path, lattice=f'{SKIN}\n[[keep]]\nregion = "left"\nmargin = "5 mm"')
    inner = internal(written(tmp_path), 12)
    assert inner.vertices[inner.faces][..., 0].min() == pytest.approx(5.0, abs=1e-3)


def test_chord_tolerance_leaves_the_outer_triangles(kept, tmp_path):
    result = made(tmp_path, printed='chord_tolerance = "0.05 mm"')
    assert result.printed["outer"]["kept"] == "bytes"
    folder, fine = kept
    assert len(written(tmp_path).faces) < 0.6 * len(written(folder).faces)
    assert result.measures["volume_mm3"] == pytest.approx(fine.measures["volume_mm3"], rel=0.01)


@pytest.mark.parametrize(
    ("lattice", "words"),
    [
        ("", "needs a skin all round"),
        ('skin = [{thickness = "1 mm", faces = "left"}]', "needs a skin all round"),
        ('skin = {thickness = "1 mm", net = true}', "needs a skin all round"),
        (f'{SKIN}\ndrain = {{diameter = "1 mm"}}', "holes cut the triangles"),
    ],
)
def test_what_would_open_the_outer_surface_is_refused_by_name(tmp_path, lattice, words):
    with pytest.raises(CaseError, match=f"print.outer.*{words}"):
        made(tmp_path, lattice=lattice)


def test_same_refusal_in_run(tmp_path):
    part_file(tmp_path)
    text = CASE.format(lattice="", outer="cad", printed="", units="mm").replace(
        "density = 0.3", "density = [0.2, 0.5]"
    )
    text = text.replace("[part]", '[part]\nmesh_size = "4 mm"')
    more = """
[material]
name = "PA12"
[[load_case]]
name = "pull"
fix = [{region = "left"}]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[limits]
stress = "5 MPa"
"""
    (tmp_path / "case.toml").write_text(text + more)
    with pytest.raises(CaseError, match=r"print.outer.*needs a skin all round"):
        load_case(tmp_path)


def test_skin_thinner_than_the_grid_holds_is_refused(tmp_path):
    with pytest.raises(LatticeError, match=r"skin of 0\.2 mm.*at least"):
        made(tmp_path, lattice='skin = "0.2 mm"')


def test_cavity_that_is_open_to_the_outside_is_refused_with_the_place():
    """A hole through the skin, which no case states beside the key."""
    part = box_surface(EDGES)
    hole = Drain(
        mouth=np.array([6.0, 4.0, 8.0]), inward=np.array([0.0, 0.0, -1.0]), radius=1.0, depth=3.0
    )
    domain = DesignDomain(
        distance=surface_distance(part),
        lower=(0, 0, 0),
        upper=EDGES,
        components=(Skin(thickness=1.5), hole),
    )
    design = LatticeDesign(
        domain=domain,
        cells=plain_cells(lambda u: np.ones(u.shape[1:]) + 0.1 * u[0]),
        cell_map=lambda p: np.asarray(p) / 4.0,
        cell_size=4.0,
        density=0.3,
    )
    with pytest.raises(LatticeError, match=r"reaches the part's faces at \(.*, .*, 8"):
        surface_behind_skin(design, part, 0.4)
    closed = surface_behind_skin(
        replace(design, domain=replace(domain, components=domain.solids)), part, 0.4
    )
    assert enclosed_volume(closed) == pytest.approx(np.prod(EDGES) - 9 * 5 * 5, rel=1e-6)
