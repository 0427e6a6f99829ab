"""Drain holes: closed voids are found, each gets one hole, and the holes have their volume."""

from dataclasses import replace

import numpy as np
import pytest
from composed_domains import KINDS, design_domain
from plain_cells import plain_cells

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.component_place import component_place
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.errors import CaseError, ResourceError
from gradedesign.geometry.lattice.component_kind import with_cuts
from gradedesign.geometry.lattice.components import drain as module
from gradedesign.geometry.lattice.components.drain import Drain, closed_voids
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance

CASE = """\
[case]
name = "drained"
[part]
box = ["16 mm", "8 mm", "8 mm"]
[region.top]
plane = "z = max"
[region.side]
plane = "x = min"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = 0.25
"""


def designed(folder, more):
    """The lattice of a case before its drain holes, and the case."""
    (folder / "case.toml").write_text(CASE + more)
    case = load_case(folder)
    part = part_of(case, {})
    design = LatticeDesign(
        domain=design_domain(case, part),
        cells=plain_cells(gyroid_sheet, 0.0, 1.4),
        cell_map=lambda p: np.asarray(p) / 8.0,
        cell_size=8.0,
        density=0.25,
    )
    return case, part, design


def drained(case, part, design):
    """The domain of a design with its drain holes."""
    return with_cuts(component_place(case, part), KINDS, design, 8.0)


def gyroid_sheet(u):
    x, y, z = 2 * np.pi * u
    return np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))


def test_a_hole_is_a_cylinder_with_a_round_bottom():
    """pi r^2 depth and half a ball below the mouth, counted."""
    drain = Drain(mouth=[0, 0, 0], inward=[0, 0, 1], radius=1.0, depth=3.0)
    axis = (np.arange(120) + 0.5) / 120 * 5
    points = np.array(np.meshgrid(axis - 2.5, axis - 2.5, axis, indexing="ij"))
    volume = (drain.distance(points) < 0).mean() * 125
    assert volume == pytest.approx(np.pi * 3 + 2 / 3 * np.pi, rel=0.01)


def test_rooms_of_a_box_are_its_closed_voids():
    """A wall halves a box of 10 x 6 x 6 mm with a skin of 1 mm: two rooms of 3.5 x 4 x 4 mm."""
    size = (10.0, 6.0, 6.0)
    design = LatticeDesign(
        domain=DesignDomain(
            distance=surface_distance(box_surface(size)),
            lower=(0, 0, 0),
            upper=size,
            components=(Skin(thickness=1.0),),
        ),
        cells=plain_cells(lambda u: np.abs(u[0] - 0.5) - 0.05),
        cell_map=lambda p: np.asarray(p) / 10.0,
        cell_size=10.0,
        density=0.2,
    )
    found = closed_voids(design, 4.0, 1.0)
    assert len(found.volumes) == 2
    # Voxels of 0.25 mm more than half of one from the solid.
    assert found.volumes == pytest.approx([3.25 * 3.75**2] * 2, rel=0.15)
    hole = Drain(mouth=[2.5, 3.0, 0.0], inward=[0, 0, 1], radius=0.8, depth=1.2)
    opened = replace(design, domain=design.domain.with_components([hole]))
    assert len(closed_voids(opened, 4.0, 1.0).volumes) == 1


def test_every_void_behind_a_skin_gets_one_hole(tmp_path):
    case, part, design = designed(tmp_path, 'skin = "1 mm"\ndrain = {diameter = "2 mm"}\n')
    found = drained(case, part, design)
    # Both sides of a gyroid sheet.
    assert len(found.cuts) == 2
    assert found.notes == ()
    for drain in found.cuts:
        assert abs(float(design.domain.distance(drain.mouth[:, None])[0])) < 1e-9
        assert drain.radius == 1.0
    field = lattice_field(replace(design, domain=found))
    mouths = np.stack([d.mouth + 0.01 * d.inward for d in found.cuts], axis=1)
    assert (field(mouths) > 0).all()
    assert (lattice_field(design)(mouths) < 0).all()


def test_holes_stay_off_what_is_kept(tmp_path):
    """Only the faces across x are free: the four others lie in the margin of kept ones."""
    more = (
        'skin = "1 mm"\ndrain = {diameter = "1.5 mm"}\n'
        '[region.ends]\nany = ["side"]\n[[keep]]\nregion = "top"\nmargin = "1 mm"\n'
    )
    case, part, design = designed(tmp_path, more)
    for drain in drained(case, part, design).cuts:
        assert drain.mouth[2] < 8.0 - 1.0 - 0.75


def test_stated_places_are_taken_and_what_stays_closed_is_said(tmp_path):
    at = 'drain = {diameter = "2 mm", at = [["8 mm", "0 mm", "4 mm"]]}\n'
    case, part, design = designed(tmp_path, 'skin = "1 mm"\n' + at)
    found = drained(case, part, design)
    assert found.cuts[0].mouth == pytest.approx([8, 0, 4], abs=1e-9)
    assert found.cuts[0].inward == pytest.approx([0, 1, 0], abs=1e-6)
    # The hole opens one of the two voids.
    assert [note for note in found.notes if "1 voids have no way out" in note] == list(found.notes)


def test_an_open_lattice_needs_no_hole(tmp_path):
    more = 'skin = {thickness = "1 mm", faces = "top"}\ndrain = {diameter = "2 mm"}\n'
    case, part, design = designed(tmp_path, more)
    found = drained(case, part, design)
    assert found.cuts == ()
    assert "no void is closed" in found.notes[0]


def test_places_off_the_surface_are_refused(tmp_path):
    at = 'drain = {diameter = "2 mm", at = [["8 mm", "4 mm", "4 mm"]]}\n'
    case, part, design = designed(tmp_path, 'skin = "1 mm"\n' + at)
    with pytest.raises(CaseError, match=r"at\[0\].*4 mm off the part's surface"):
        drained(case, part, design)


def test_a_skin_that_closes_the_lattice_is_a_warning(tmp_path):
    for more, warned in (
        ('skin = "1 mm"', True),
        ('skin = [{thickness = "1 mm", faces = ["top"]}]', False),
        ('skin = "1 mm"\ndrain = {diameter = "1.5 mm"}', False),
        ('skin = {thickness = "1 mm", net = true}', False),
    ):
        _, _, design = designed(tmp_path, more)
        told = [text for text in design.domain.notes if "cannot leave" in text]
        assert len(told) == warned
        assert all(text.startswith("case.toml:13: lattice.skin") for text in told)


def test_too_many_cells_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "MOST_VOXELS", 1000)
    _, _, design = designed(tmp_path, 'skin = "1 mm"\n')
    with pytest.raises(ResourceError, match="name the places"):
        closed_voids(design, 8.0, 1.0)
