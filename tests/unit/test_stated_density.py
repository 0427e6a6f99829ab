"""A run of a stated density: what it writes, what it says, what it refuses."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import fitting_part
from gradedesign.design.resolve.stated_cells import placed_cells, stated_cells
from gradedesign.design.resolve.stated_density import stated_density
from gradedesign.design.resolve.stated_lattice import stated_lattice
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.contour.surface import require_closed
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.formats.write_stl import surface_of_stl
from gradedesign.geometry.lattice.density_grid import evaluate
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

CASE = """\
[case]
name = "ramp"
[part]
box = ["15 mm", "5 mm", "5 mm"]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
"""
RAMP = '[lattice.density_map]\nformula = "0.2 + 0.02 * x"\n'


def write(folder, text):
    (folder / "case.toml").write_text(text)
    return folder


@pytest.mark.usefixtures("drawn")
def test_a_ramp_is_generated_with_picture_surface_and_slabs(tmp_path, cli):
    case = write(tmp_path, CASE + RAMP + '[material]\nname = "Ti-6Al-4V"\n')
    ended = cli("run", case, "-o", tmp_path / "out")
    assert ended.code == 0, ended.err
    assert "Relative density by slabs of one cell" in ended.out
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["status"] == "partial"
    assert set(result["files"].values()) == {
                    "lattice.stl", "lattice.png", "slabs.csv", "report.html", "result.json",
                    "scene.json", "case-as-run.toml",
    }  # fmt: skip
    slabs = result["measures"]["density"]["slabs"]["x"]
    np.testing.assert_allclose(slabs["target"], [0.25, 0.35, 0.45], atol=1e-3)
    np.testing.assert_allclose(slabs["field"], slabs["target"], atol=0.01)
    np.testing.assert_allclose(slabs["surface"], slabs["target"], atol=0.01)
    rows = list(csv.DictReader((tmp_path / "out" / "slabs.csv").read_text().splitlines()))
    assert [r["axis"] for r in rows] == ["x", "x", "x", "y", "z"]
    # The STL holds the volume that the result states: read back by our own strict reader.
    corners = read_stl(tmp_path / "out" / "lattice.stl").corners
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(result["measures"]["volume_mm3"], rel=1e-4)
    assert volume / 375 == pytest.approx(result["relative_density"], rel=1e-3)
    assert result["mass_g"] == pytest.approx(4.41e-3 * volume, rel=1e-3)
    assert result["mass_g"] == pytest.approx(
        result["relative_density"] * result["solid_mass_g"], rel=1e-9
    )
    scene = json.loads((tmp_path / "out" / "scene.json").read_text())
    assert [view["id"] for view in scene["views"]] == ["printed", "cells", "case"]
    assert scene["printed"]["triangles"]["rows"] == len(corners)
    again = cli("run", case, "-o", tmp_path / "out")
    assert again.code == 2
    assert "overwrite" in again.err


def test_an_output_that_has_nothing_to_write_says_so(tmp_path, cli):
    for name, output in (("stated", '[output]\nformats = ["stl", "vtu"]\n'), ("default", "")):
        case = write(tmp_path, CASE + "density = 0.3\n" + output)
        ended = cli("run", case, "-o", tmp_path / name, "--json")
        said = " ".join(json.loads(ended.out)["warnings"])
        assert ("format 'vtu' has written nothing" in said) == (name == "stated")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One small lattice per source, all of the same ramp from 0.2 to 0.4 along x."""
    folder = tmp_path_factory.mktemp("sources")
    x = (np.arange(30) + 0.5) / 30
    np.save(folder / "map.npy", np.broadcast_to((0.2 + 0.2 * x)[:, None, None], (30, 2, 2)))
    (folder / "slices").mkdir()
    row = np.round(255 * np.broadcast_to(x, (4, 30))).astype(np.uint8)
    for n in range(3):
        Image.fromarray(row).save(folder / "slices" / f"{n}.png")
    axes = (np.arange(11.0), np.arange(6.0), np.arange(6.0))
    grid = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    np.savetxt(folder / "points.csv", np.c_[grid.T, 0.2 + 0.02 * grid[0]], delimiter=",")
    return folder


@pytest.mark.parametrize(
    ("source", "more", "tolerance"),
    [
        ('formula = "0.2 + 0.02 * x"', "", 1e-4),
        ('voxels = "map.npy"', "", 1e-3),
        ('images = "slices"', "density = [0.2, 0.4]", 2e-3),
        ('points = "points.csv"\nspacing = "1 mm"', "", 1e-9),
    ],
    ids=["formula", "voxels", "images", "points"],
)
def test_every_source_gives_the_same_density(made, source, more, tolerance):
    text = CASE.replace("15 mm", "10 mm")
    case = load_case(write(made, f"{text}{more}\n[lattice.density_map]\n{source}\n"))
    half = np.array([5.0, 2.5, 2.5])[:, None]
    found = stated_density(
        case,
        build_registry(),
        None,
        domain=DesignDomain(
            distance=lambda p: (
                (np.abs(p.reshape(3, -1) - half) - half).max(axis=0).reshape(p.shape[1:])
            ),
            lower=np.zeros(3),
            upper=2 * half[:, 0],
        ),
        window=(0.1, 0.5),
        level_of=np.asarray,
    )
    x = np.linspace(0.5, 9.5, 19)
    points = np.stack([x, np.full(19, 1.7), np.full(19, 3.1)])
    np.testing.assert_allclose(evaluate(found, points), 0.2 + 0.02 * x, atol=tolerance)


def test_a_function_takes_the_place_of_the_density(tmp_path):
    case = load_case(write(tmp_path, CASE.replace("15 mm", "5 mm") + "density = 0.3\n"))
    out = tmp_path / "out"
    with pytest.raises(DensityError, match="function asks for"):
        run(case, folder=out, density=lambda p: 0.3 + p[0])
    assert json.loads((out / "result.json").read_text())["status"] == "failed"


REFUSED = {
    "no density": ("", CaseError, "or state the density of the lattice, such as density = 0.3"),
    "a range alone": ("density = [0.2, 0.4]", CaseError, r"missing; add \[limits\], or state"),
    "formula and map": (f'density = "0.2 + x / 99"\n{RAMP}', CaseError, "formula and a map"),
    "beyond the window": ("density = 0.995", DensityError, r"lattice\.density: cell .*exists"),
    "map beyond it": (
        '[lattice.density_map]\nformula = "1 - x / 15"',
        DensityError,
        r"density_map\.formula: the density formula asks for lowest 0 at \(15,",
    ),
    "beyond its own range": (
        f"density = [0.25, 0.4]\n{RAMP}", DensityError, "allowed are 0.25 to 0.4",
    ),
    "number and map": (f"density = 0.3\n{RAMP}", CaseError, "contradict"),
    "uniform map": (f'grading = "uniform"\n{RAMP}', CaseError, "uniform"),
    "two sources": (f'{RAMP}voxels = "case.toml"', CaseError, "not such a file"),
    "bad formula": ('[lattice.density_map]\nformula = "import os"', CaseError, "unknown name"),
    "empty map": ("[lattice.density_map]", CaseError, "exactly one of formula"),
    "stray key": (f'{RAMP}spacing = "1 mm"', CaseError, "belongs to points"),
    "no such file": ('[lattice.density_map]\nvoxels = "a.npy"', CaseError, "does not exist"),
    "outside": ('[lattice.density_map]\nvoxels = "../a.npy"', CaseError, "allow_outside=True"),
    "no folder": ('[lattice.density_map]\nimages = "a"', CaseError, "expected a folder"),
    "warp far away": (
        'density = 0.3\n[[lattice.warp]]\ncentre = ["99 mm", "5 mm", "5 mm"]\n'
        'stable_radius = "5 mm"\nouter_radius = "10 mm"\nmagnification = 1.2',
        CaseError,
        r"lattice\.warp\[0\]\.centre: found \(99, 5, 5\) mm, but the lattice comes no nearer",
    ),
    "weight beyond 1": (
        'density = 0.3\n[lattice.transition]\ncell = "bcc"\nweight = "x"',
        DensityError,
        r"transition\.weight: the weight of the transition asks for .*highest 15",
    ),
    "three cells": (
        'density = 0.3\n[[zone]]\nformula = "x - 2"\ncell = "bcc"\ntransition = "3 mm"\n'
        '[[zone]]\nformula = "13 - x"\ncell = "sc"\ntransition = "3 mm"',
        CaseError,
        r"case\.toml:9: zone: found 3 different cells",
    ),
    "second unknown": (
        'density = 0.3\n[lattice.transition]\ncell = "bbc"\nweight = "0.5"', CaseError, "bcc",
    ),
    "unknown cell": ("density = 0.3", CaseError, "gyroid"),
    "nothing but solid": (
        'density = 0.3\n[[keep]]\nregion = "root"\nmargin = "500 mm"\n'
        '[region.root]\nplane = "x = min"',
        CaseError,
        r"keep\[0\]\.margin: found 500 mm, but no place of the part is farther than",
    ),
    "thin wall": (
        'density = 0.05\n[print]\nmin_wall = "0.8 mm"', CaseError, "min_wall need at least",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("more", "kind", "words"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_named(tmp_path, more, kind, words):
    text = CASE.replace("gyroid-sheet", "gyroid-shet") if "gyroid" in words else CASE
    with pytest.raises(kind, match=words):
        run(load_case(write(tmp_path, text + more)), folder=tmp_path / "out")


def test_a_transition_is_generated_and_its_neck_told(tmp_path):
    text = CASE.replace("15 mm", "10 mm").replace("gyroid-sheet", "primitive-sheet")
    more = 'density = 0.3\n[lattice.transition]\ncell = "sc"\nweight = "smoothstep(2, 8, x)"\n'
    case = load_case(write(tmp_path, text + more))
    cells = stated_cells(case, build_registry())
    placed, told = placed_cells(
        case,
        cells,
        lambda p: p / 5.0,
        density=0.3,
        domain=DesignDomain(
            distance=lambda p: -np.ones(p.shape[1:]),
            lower=np.zeros(3),
            upper=np.array([10.0, 5.0, 5.0]),
        ),
    )
    # Unmoved, the struts run through the holes of the sheet.
    assert any(told["shift_cells"])
    assert told["neck_over_two_cells"]["components"] == 1
    points = np.array([[1.0, 5.0, 9.0], [1.3, 1.3, 1.3], [2.1, 2.1, 2.1]])
    np.testing.assert_allclose(placed.weights_at(points)[1], [0, 0.5, 1], atol=0.01)


def test_a_zone_is_the_transition_with_its_weight(tmp_path):
    """Six millimetres of ``3 s^2 - 2 s^3`` about x = 5 mm, as a weight and as a zone's border."""
    registry, found = build_registry(), []
    text = CASE.replace("15 mm", "10 mm").replace("gyroid-sheet", "primitive-sheet")
    for more in (
        '[lattice.transition]\ncell = "sc"\nweight = "smoothstep(2, 8, x)"\n',
        '[[zone]]\nformula = "5 - x"\ncell = "sc"\ntransition = "6 mm"\n',
    ):
        case = load_case(write(tmp_path, f"{text}density = 0.3\n{more}"))
        found.append(stated_lattice(case, registry, fitting_part(case, registry)[1]))
    transition, zone = found
    assert zone.transition["shift_cells"] == transition.transition["shift_cells"]
    assert zone.transition["neck_over_two_cells"] == transition.transition["neck_over_two_cells"]
    points = np.random.default_rng(20260127).uniform(0, [10, 5, 5], (500, 3)).T
    own, meant = (each.design.cells.weights_at(points) for each in (zone, transition))
    # The weight lies on a grid of 0.625 mm: h^2 / 8 of the second derivative, 6 / 6^2 at most.
    np.testing.assert_allclose(own, meant, atol=0.625**2 / 8 / 6)


ANALYSED = """\
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "PA12"
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["1 N", "0 N", "0 N"]}]
[limits]
stress = "20 MPa"
"""


def test_a_run_with_loads_builds_the_stated_lattice_and_says_that_no_limit_is_judged(tmp_path, cli):
    """The surface is that without loads; both number and formula, and looked at by check."""
    box = CASE.replace("15 mm", "5 mm") + 'density = "0.3 + 0 * x"\n'
    bodies = []
    for name, more in (("alone", ""), ("loaded", ANALYSED)):
        case = write(tmp_path, box + more)
        checked = json.loads(cli("check", case, "--json").out)
        assert checked["density"] == pytest.approx([0.3, 0.3], rel=1e-12)
        ended = cli("run", case, "-o", tmp_path / name, "--json")
        assert ended.code == 0, ended.err
        result = json.loads(ended.out)
        told = [w for w in result["warnings"] if "limits: not judged" in w]
        assert len(told) == (1 if more else 0)
        assert told == [w for w in checked["warnings"] if "limits: not judged" in w]
        assert (result["status"], result["limits"]) == ("partial", [])
        bodies.append((tmp_path / name / "lattice.stl").read_bytes())
    assert bodies[0] == bodies[1]
    # PA12 of the library: 0.93 g/cm^3, 125 mm^3.
    assert checked["part"]["solid_mass_g"] == pytest.approx(0.11625, rel=1e-9)
    ended = cli("check", case, "--estimate")
    assert ended.code == 2
    assert "--estimate sizes a lattice, and the density of this one is stated" in ended.err


def test_a_finished_run_of_a_stated_density_is_not_built_again(tmp_path, cli):
    case = write(tmp_path, CASE.replace("15 mm", "5 mm") + "density = 0.3\n")
    assert cli("run", case, "-o", tmp_path / "out").code == 0
    before = (tmp_path / "out" / "lattice.stl").stat().st_mtime_ns
    ended = cli("run", case, "-o", tmp_path / "out", "--resume")
    assert ended.code == 0
    assert "holds the result of this case; nothing is run" in ended.out
    assert "Relative density by slabs of one cell" in ended.out
    assert (tmp_path / "out" / "lattice.stl").stat().st_mtime_ns == before


def test_a_function_needs_a_case_that_states_its_density(tmp_path):
    case = load_case(write(tmp_path, CASE + "density = [0.2, 0.4]\n" + ANALYSED))
    with pytest.raises(CaseError, match="takes the place of a stated density"):
        run(case, folder=tmp_path / "out", density=lambda p: 0.3 + p[0])


def test_triangles_follow_a_stated_chord_tolerance(tmp_path, cli):
    """A third of the triangles or fewer within 0.02 mm, the same volume, closed as a file."""
    case = CASE.replace("15 mm", "5 mm") + "density = 0.3\n"
    found = {}
    for name, more in (("all", ""), ("few", '[print]\nchord_tolerance = "0.02 mm"\n')):
        ended = cli("run", write(tmp_path, case + more), "-o", tmp_path / name)
        assert ended.code == 0, ended.err
        data = (tmp_path / name / "lattice.stl").read_bytes()
        found[name] = surface_of_stl(data, name)
    assert len(found["few"].faces) < len(found["all"].faces) / 3
    # 0.02 mm of 0.43 mm thick walls, on both sides of them and mostly inwards where they bulge
    assert require_closed(found["few"]) == pytest.approx(require_closed(found["all"]), rel=0.02)
    ended = cli("run", write(tmp_path, case + '[print]\nchord_tolerance = "0 mm"\n'))
    assert ended.code == 2
    assert "chord_tolerance" in ended.err


def test_powder_that_a_skin_closes_in_is_told(tmp_path, cli):
    """Both rooms of one gyroid cell, in the box within the skin less its sheet."""
    case = CASE.replace("15 mm", "5 mm") + 'density = 0.3\nskin = "0.5 mm"\n'
    ended = cli("run", write(tmp_path, case), "-o", tmp_path / "closed", "--json")
    assert ended.code == 0, ended.err
    result = json.loads(ended.out)
    # 0.7 of 4^3 mm^3; the cell is cut 0.5 mm from its faces, where it may hold more or less.
    assert result["measures"]["closed_voids"]["volume_mm3"] == pytest.approx(0.7 * 64, rel=0.05)
    # Solid and voids fill the box.
    filled = result["relative_density"] * 125 + result["measures"]["closed_voids"]["volume_mm3"]
    assert filled == pytest.approx(125, rel=1e-4)
    (told,) = (text for text in result["warnings"] if text.startswith("the printed solid has"))
    assert f"{result['measures']['closed_voids']['count']} closed voids of" in told
    ended = cli("run", write(tmp_path, CASE + RAMP), "-o", tmp_path / "open", "--json")
    assert not [text for text in json.loads(ended.out)["warnings"] if "closed void" in text]
