"""3MF files of generated lattices: units, metadata, beams; against the field and lib3mf."""

import json
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import single
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.maps.cell_map import uniform_map
from gradedesign.geometry.part.box import box_surface
from gradedesign.program.host.registry import build_registry
from gradedesign_formats.beams import beam_lattice
from gradedesign_formats.read_back_3mf import read_back
from gradedesign_formats.write_3mf import BALLS, BEAMS, CORE, export_3mf_beams

CASE = """\
[case]
name = "R&D <bar> \\"7\\""
[part]
box = ["{length} mm", "12 mm", "12 mm"]
{keep}
[material]
name = "PA12"
[lattice]
cell = "{cell}"
size = "6 mm"
origin = ["1 mm", "0 mm", "0 mm"]
{lattice}
[output]
formats = ["3mf", "3mf-beams"]
"""


def generated(cli, folder, *, cell="bcc", lattice="density = 0.15", length=24, keep=""):
    text = CASE.format(cell=cell, lattice=lattice, length=length, keep=keep)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", folder, "-o", folder / "out")
    return ended, folder / "out"


def model(path):
    with zipfile.ZipFile(path) as package:
        assert package.testzip() is None
        return ElementTree.fromstring(package.read("3D/3dmodel.model"))


def beam_distance(lattice, points):
    """Distance to the union of beams (cones between balls), the oracle: every beam in turn."""
    nearest = np.full(points.shape[1], np.inf)
    for (a, b), (r1, r2) in zip(lattice.nodes[lattice.beams], lattice.radii, strict=True):
        along = b - a
        s = np.clip((points.T - a) @ along / (along @ along), 0, 1)
        off = np.linalg.norm(points.T - a - s[:, None] * along, axis=1)
        nearest = np.minimum(nearest, off - (r1 + s * (r2 - r1)))
    return nearest


def test_surface_and_beams_carry_unit_names_and_metadata(cli, tmp_path):
    ended, out = generated(cli, tmp_path)
    assert ended.code == 0, ended.err
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["files"]["lattice_3mf"] == "lattice.3mf"
    assert result["files"]["lattice_3mf-beams"] == "lattice-3mf-beams.3mf"
    for name in ("lattice.3mf", "lattice-3mf-beams.3mf"):
        root = model(out / name)
        assert root.get("unit") == "millimeter"
        told = {m.get("name"): m.text for m in root.iter(f"{{{CORE}}}metadata")}
        assert told["Title"] == 'R&D <bar> "7"'
        assert told["g:material"] == "PA12"
        assert told["g:case_hash"] == result["case_hash"]
        objects = [o.get("name") for o in root.iter(f"{{{CORE}}}object")]
        assert objects[-1] == 'R&D <bar> "7"'
    # bcc has 8 struts a cell, cells of 6 mm fill 4 (and a part of a fifth) x 2 x 2; struts that
    # only touch the part from outside belong to it too.
    whole, beams = read_back(out / "lattice.3mf")[0], read_back(out / "lattice-3mf-beams.3mf")[1]
    assert len(beams.beams) >= 4 * 2 * 2 * 8
    assert np.ptp(beams.radii) == 0
    lattice = next(model(out / "lattice-3mf-beams.3mf").iter(f"{{{BEAMS}}}beamlattice"))
    assert (lattice.get("cap"), lattice.get("clippingmode")) == ("sphere", "inside")
    assert lattice.get("clippingmesh") == "1"
    # Written as beams, the lattice takes a fiftieth of its surface, however small.
    assert (
        50 * (out / "lattice-3mf-beams.3mf").stat().st_size < (out / "lattice.3mf").stat().st_size
    )
    # Every vertex of the printed surface lies on a beam, outside it by what its triangles lack, or
    # on the box.
    v = whole.vertices
    on_box = (np.minimum(np.abs(v), np.abs(v - [24, 12, 12])) < 1e-3).any(axis=1)
    inner = v[~on_box][::50]

    class Read:
        nodes, beams_ = beams.vertices, beams.beams

    Read.beams, Read.radii = beams.beams, beams.radii
    off = beam_distance(Read, inner.T)
    # On a grid of 0.25 mm the sag of a strut of 1.0 mm is h^2 / 8 r = 0.016 mm, three of them where
    # struts meet.
    assert np.abs(off).max() < 0.05
    assert 0.0 < off.mean() < 0.016


@pytest.mark.parametrize(
    ("cell", "refused"), [("gyroid-sheet", "round struts"), ("bcc-square", "round")]
)
def test_what_is_no_round_strut_is_refused(cli, tmp_path, cell, refused):
    ended, _ = generated(cli, tmp_path, cell=cell, lattice="density = 0.3", length=12)
    assert ended.code == 2
    assert refused in ended.err


def test_graded_radii_follow_the_density_and_balls_the_nodes(cli, tmp_path):
    ended, out = generated(
        cli,
        tmp_path,
        lattice="density = [0.05, 0.3]\nparameters = {node_ratio = 1.5}\n"
        '[lattice.density_map]\nformula = "0.06 + 0.009 * x"',
        keep='[region.end]\nplane = "x = max"\n[[keep]]\nregion = "end"\nmargin = "2 mm"',
    )
    assert ended.code == 0, ended.err
    _, beams = read_back(out / "lattice-3mf-beams.3mf")
    middle = beams.vertices[beams.beams].mean(axis=1)[:, 0]
    inside = (middle > 2) & (middle < 20)
    slope = np.polyfit(middle[inside], beams.radii.mean(axis=1)[inside], 1)[0]
    assert slope > 0
    assert len(beams.balls)
    node = beams.balls[:, 0].astype(int)
    at = {
        n: r
        for pair, both in zip(beams.beams, beams.radii, strict=True)
        for n, r in zip(pair, both, strict=True)
    }
    np.testing.assert_allclose(beams.balls[:, 1], 1.5 * np.array([at[n] for n in node]), rtol=1e-6)
    # The kept end is solid: a slab of 12 x 12 x 2 mm.
    assert len(beams.faces)
    root = model(out / "lattice-3mf-beams.3mf")
    assert root.get("requiredextensions") == "b b2"
    assert len(list(root.iter(f"{{{BALLS}}}ball"))) == len(beams.balls)


@pytest.mark.parametrize("graded", [False, True])
def test_lib3mf_reads_twenty_thousand_struts(tmp_path, graded):
    lib3mf = pytest.importorskip("lib3mf")
    cell = calibrate(build_registry().cell_families["bcc"], {})
    size = np.array([84.0, 84.0, 78.0])
    part = box_surface(size)
    values = np.linspace(0.05, 0.2, 3)[:, None, None] * np.ones((3, 2, 2))
    ramp = DensityGrid(origin=np.zeros(3), spacing=84.0, values=values)
    design = LatticeDesign(
        domain=DesignDomain(
            distance=lambda p: np.abs(p.T - size / 2).T.max(axis=0) - size.min() / 2,
            lower=np.zeros(3),
            upper=size,
        ),
        cells=single(cell),
        cell_map=uniform_map(6.0),
        cell_size=6.0,
        density=ramp if graded else 0.1,
    )
    beams = beam_lattice(design, part)
    assert len(beams.beams) > 20_000
    path = tmp_path / "beams.3mf"
    lattice = PrintedLattice(surface=part, name="20,000 struts", design=design, part=part)
    export_3mf_beams(path, lattice)
    reader = (held := lib3mf.get_wrapper().CreateModel()).QueryReader("3mf")
    reader.ReadFromFile(str(path))
    assert [reader.GetWarning(k) for k in range(reader.GetWarningCount())] == []
    objects = held.GetMeshObjects()
    found = [objects.GetCurrentMeshObject() for _ in range(2) if objects.MoveNext()]
    clip, read = found
    struts = read.BeamLattice()
    assert struts.GetBeamCount() == len(beams.beams)
    got = struts.GetBeams()
    np.testing.assert_array_equal([list(b.Indices) for b in got], beams.beams)
    np.testing.assert_allclose([list(b.Radii) for b in got], beams.radii, rtol=1e-6)
    places = [list(v.Coordinates) for v in read.GetVertices()]
    np.testing.assert_allclose(places, beams.nodes, atol=1e-5)
    assert {(b.CapModes[0], b.CapModes[1]) for b in got} == {
        (lib3mf.BeamLatticeCapMode.Sphere,) * 2
    }
    assert struts.GetClipping() == (lib3mf.BeamLatticeClipMode.Inside, clip.GetResourceID())
    assert struts.GetBallOptions()[0] == lib3mf.BeamLatticeBallMode(0)
    # The surface has 4.5 kB a strut, see above: a hundred times as much.
    assert path.stat().st_size < 50 * len(beams.beams)
