"""Inner edges of skins rounded, small cavities solid: fields, case keys, files."""

import numpy as np
import pytest
from composed_domains import design_domain
from plain_cells import plain_cells

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.lattice.components.filling import Filling
from gradedesign.geometry.lattice.domain import SKIN, phase_at
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

EDGES = np.array([20.0, 12.0, 12.0])
CASE = """\
[case]
name = "filled"
[part]
box = ["20 mm", "12 mm", "12 mm"]
[region.top]
plane = "z = max"
[region.side]
plane = "y = max"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = 0.3
"""
SKIN_KEY = 'skin = "1.5 mm"\n'
#: A wall that parts a room of 3 mm along x from one of 12.5 mm.
WALL = """
[[keep]]
box = {lower = ["14 mm", "0 mm", "0 mm"], upper = ["15.5 mm", "12 mm", "12 mm"]}
"""


def read(folder, more):
    folder.mkdir(exist_ok=True)
    (folder / "case.toml").write_text(CASE + more)
    return load_case(folder)


def domain_of(folder, more):
    case = read(folder, more)
    return design_domain(case, part_of(case, {}))


def points(n=80):
    axes = [(np.arange(m) + 0.5) * s / m for m, s in zip((n, n, n), EDGES, strict=True)]
    return np.array(np.meshgrid(*axes, indexing="ij"))


def solid_volume(domain, band=None):
    """Of a lattice that has no solid of its own."""
    empty = LatticeDesign(
        domain=domain,
        cells=plain_cells(lambda u: np.ones(u.shape[1:]) + 0.1 * u[0]),
        cell_map=lambda p: np.asarray(p) / 8.0,
        cell_size=8.0,
        density=0.3,
    )
    return float((lattice_field(empty, band=band)(points()) < 0).mean() * EDGES.prod())


def rounded_box(edges, radius):
    """Steiner's formula: volume within a radius of a box that is smaller by it all round."""
    a, b, c = np.asarray(edges) - 2 * radius
    return (
        a * b * c
        + 2 * radius * (a * b + b * c + c * a)
        + np.pi * radius**2 * (a + b + c)
        + 4 / 3 * np.pi * radius**3
    )


@pytest.mark.parametrize("band", [None, 0.5])
def test_bevel_leaves_the_room_that_a_ball_reaches(tmp_path, band):
    domain = domain_of(tmp_path, SKIN_KEY + 'bevel = "3 mm"')
    room = rounded_box(EDGES - 3.0, 3.0)
    # Counted on 80^3 points; sharp edges would be off by 14 %.
    assert solid_volume(domain, band) == pytest.approx(EDGES.prod() - room, rel=4e-3)
    corner = np.array([[1.7], [1.7], [6.0]])
    assert phase_at(domain, corner).tolist() == [SKIN]


def test_bevel_of_a_box_is_that_of_its_distance(tmp_path):
    """Outside a box of 11 x 3 x 3 mm, in which the centres of the balls lie."""
    domain = domain_of(tmp_path, SKIN_KEY + 'bevel = "3 mm"')
    places = np.random.default_rng(7).random((3, 20_000)) * EDGES[:, None]
    beyond = np.abs(places - EDGES[:, None] / 2) - (EDGES[:, None] / 2 - 4.5)
    outside = (beyond > 0).any(axis=0)
    expected = 3.0 - np.linalg.norm(np.maximum(beyond, 0.0), axis=0)
    found = domain.of(Filling)[0].to_place(places)
    np.testing.assert_allclose(found[outside], expected[outside], atol=0.01)


def test_bevel_follows_the_circle_between_two_skins_on_faces(tmp_path):
    faces = 'skin = {thickness = "1.5 mm", faces = ["top", "side"]}\n'
    domain = domain_of(tmp_path, faces + 'bevel = "3 mm"')
    centre = np.array([10.0, 12.0 - 4.5, 12.0 - 4.5])
    angles = np.linspace(0, np.pi / 2, 31)
    for radius, solid in ((3.0 - 0.03, False), (3.0 + 0.03, True)):
        at = centre[:, None] + radius * np.array([0 * angles, np.cos(angles), np.sin(angles)])
        assert ((phase_at(domain, at) == SKIN) == solid).all()


def test_cavities_without_room_for_the_ball_are_solid(tmp_path):
    walls = EDGES.prod() - (12.5 + 3.0) * 9 * 9
    kept = domain_of(tmp_path, SKIN_KEY + 'least_cavity = "2.9 mm"' + WALL)
    assert solid_volume(kept) == pytest.approx(walls, rel=1e-9)
    filled = domain_of(tmp_path, SKIN_KEY + 'least_cavity = "3.1 mm"' + WALL)
    assert solid_volume(filled) == pytest.approx(walls + 3.0 * 9 * 9, rel=1e-9)
    # The room that stays is as it was, its corners too.
    corners = np.array([[1.55, 13.95], [1.55, 10.45], [1.55, 10.45]])
    assert (phase_at(filled, corners) != SKIN).all()


def test_cavities_are_told_apart_after_the_bevel(tmp_path):
    """A ball of 3.1 mm does not fit into 3 mm, with or without round edges."""
    both = domain_of(tmp_path, SKIN_KEY + 'bevel = "1 mm"\nleast_cavity = "3.1 mm"' + WALL)
    room = rounded_box((12.5, 9.0, 9.0), 1.0)
    assert solid_volume(both) == pytest.approx(EDGES.prod() - room, rel=5e-3)


def test_both_are_in_the_printed_file_and_said(tmp_path):
    more = 'bevel = "1 mm"\nleast_cavity = "4 mm"\n' + WALL
    case = read(tmp_path, SKIN_KEY + more)
    result = run(case, build_registry(), folder=tmp_path / "out")
    assert any("least_cavity: 1 cavity" in warning for warning in result.warnings)
    density = result.measures["density"]
    room = rounded_box((12.5, 9.0, 9.0), 1.0) / EDGES.prod()
    assert density["target"] == pytest.approx(1 - 0.7 * room, abs=0.005)
    assert density["surface"] == pytest.approx(density["target"], abs=0.02)


@pytest.mark.parametrize(
    ("lattice", "words"),
    [
        ('bevel = "1 mm"', r"lattice\.bevel.*without a skin"),
        ('least_cavity = "1 mm"', r"lattice\.least_cavity.*skin all round"),
        (
            'skin = {thickness = "1 mm", faces = "top"}\nleast_cavity = "1 mm"',
            r"lattice\.least_cavity.*skin all round",
        ),
        (SKIN_KEY + 'bevel = "4.6 mm"', r"lattice\.bevel.*no place .* for a ball of 4\.6 mm"),
        (SKIN_KEY + 'least_cavity = "9.2 mm"', r"lattice\.least_cavity.*the largest .* 9 mm"),
        (SKIN_KEY + 'bevel = "0.002 mm"', r"lattice\.bevel.*nodes"),
    ],
)
def test_what_cannot_be_filled_is_refused_by_name(tmp_path, lattice, words):
    with pytest.raises((CaseError, ResourceError), match=words):
        domain_of(tmp_path, lattice)
