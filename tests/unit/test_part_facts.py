"""What a part tells without a mesh: cylinders, thickness, centroid, free motions."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from gradedesign.design.case.read_case import load_case
from gradedesign.design.case.schema import LoadSpec, RegionSpec
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.part_tets import part_tets
from gradedesign.design.resolve.predicted_part_mesh import least_part_dofs, predicted_part_dofs
from gradedesign.design.resolve.support_conflicts import require_supported
from gradedesign.errors import CaseError
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.place_words import number
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.round_shapes import round_shapes
from gradedesign.geometry.part.thickness import local_thickness
from gradedesign.geometry.tets.mesher import PYTETWILD
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_centroid,
)
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.program.pictures.marks import action_marks

CASES = Path(__file__).parents[2] / "cases"
BODIES = """\
[case]
name = "two"
[part]
file = "two.stl"
units = "mm"
bodies = "all"
mesh_size = "5 mm"
[region.root]
plane = "x = min"
[region.other]
plane = "x = max"
[material]
name = "PA12"
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "other", force = ["50 N", "0 N", "0 N"]}]
[limits]
displacement = [{region = "other", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
"""


@pytest.fixture(scope="module")
def bracket():
    case = load_case(CASES / "bracket")
    return case, part_of(case, {".stl": read_stl})


def test_a_bearing_load_is_drawn_on_the_half_that_it_presses_on(bracket):
    case, part = bracket
    pin = LoadSpec(region="lug_hole", bearing=["500 N", "0 N", "1200 N"])
    pull = case.load_case[0].model_copy(update={"load": (pin,)})
    (mark,) = action_marks([pull], part)
    assert mark.text == "1300 N bearing"
    ahead = (mark.corners.mean(axis=1) - [12.0, 23.0, 80.0]) @ mark.vector
    assert ahead.min() > 0.0
    # Half of the facets, of a bore whose region has an even number all around.
    assert 2 * len(mark.corners) == len(part.regions["lug_hole"].corners)


def test_the_holes_of_the_bracket_are_found_with_their_selectors(bracket):
    _, part = bracket
    groups = round_shapes(part.surface, part.faces)
    # Bolts of 9 mm in spot faces of 16 mm, the lug's 12 mm, an inner rounding, the eye of the lug.
    assert [(g.kind, round(g.diameter), g.axis_name, g.count) for g in groups] == [
        ("hole", 9, "z", 4),
        ("hole", 12, "y", 1),
        ("hole", 16, "z", 4),
        ("inner rounding", 24, "y", 1),
        ("boss or rounding", 24, "y", 1),
    ]
    for group in groups[:3]:
        spec = RegionSpec.model_validate(tomllib.loads(group.selector))
        found = select_regions(part.surface, part.faces, {"holes": spec})["holes"]
        assert len(found.faces) == group.count
        assert found.area == pytest.approx(group.area)


def test_thickness_is_the_shortest_chord():
    points = np.array([[5.0, 9.0], [1.0, 3.0], [0.5, 1.5]])
    box = box_surface((10.0, 4.0, 2.0))
    assert local_thickness(box, points, np.eye(3)) == pytest.approx([2.0, 2.0])


def test_the_centroid_is_that_of_the_volume():
    box = box_surface((10.0, 4.0, 2.0))
    moved = SurfaceMesh(vertices=box.vertices + np.array([100.0, 0.0, -7.0]), faces=box.faces)
    assert enclosed_centroid(moved) == pytest.approx([105.0, 2.0, -6.0])


def test_the_mesh_of_a_box_is_predicted_exactly_and_of_the_bracket_within_two(bracket):
    case, part = bracket
    box = load_case(CASES / "mini")
    of_box = part_of(box, {})
    mesh = part_tets(box.part, of_box, PYTETWILD, box.run)
    assert predicted_part_dofs(box.part, of_box) == tet_space(mesh, 2).dof_count
    # The mesher gave 61218 unknowns at 11 mm.
    assert 61218 / 2 < predicted_part_dofs(case.part, part) < 61218 * 2
    assert least_part_dofs(case.part, part) < 61218


def test_a_body_that_nothing_holds_is_refused_without_a_mesh(tmp_path):
    box = box_surface((10.0, 10.0, 10.0))
    write_stl(
        tmp_path / "two.stl",
        SurfaceMesh(
            vertices=np.concatenate([box.vertices, box.vertices + np.array([20.0, 0.0, 0.0])]),
            faces=np.concatenate([box.faces, box.faces + len(box.vertices)]),
        ),
    )
    (tmp_path / "case.toml").write_text(BODIES, encoding="utf-8")
    case = load_case(tmp_path)
    words = r"load_case\[0\]\.fix.*of body 2, 1000 mm\^3 from \(20, 0, 0\).*: without any support"
    with pytest.raises(CaseError, match=words):
        require_supported(case.load_case, part_of(case, {".stl": read_stl}), case.where)
    held = BODIES.replace('{region = "root"}]', '{region = "root"}, {region = "other"}]')
    (tmp_path / "case.toml").write_text(held, encoding="utf-8")
    case = load_case(tmp_path)
    require_supported(case.load_case, part_of(case, {".stl": read_stl}), case.where)


@pytest.mark.parametrize(
    ("value", "words"),
    [(0.00012347, "0.0001235"), (-1e-12, "0"), (12.3456, "12.35"), (10032.104, "10032.1")],
)
def test_coordinates_are_written_to_a_hundredth_of_a_millimetre(value, words):
    assert number(value) == words
