"""Skins on chosen faces and of varying thickness, and joints: fields, case keys, files."""

import json
from functools import cache

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.components.joint import Joint, joint_volume
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import LATTICE, SKIN, DesignDomain, phase_at
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

SIZE = np.array([12.0, 8.0, 8.0])


@cache
def box_distance():
    """Distance from the box, built by the first test that needs it."""
    return surface_distance(box_surface(SIZE))


def grid(n=48):
    axes = [(np.arange(m) + 0.5) * s / m for m, s in zip((n, n, n), SIZE, strict=True)]
    return np.array(np.meshgrid(*axes, indexing="ij"))


def design(shape=lambda u: np.ones(u.shape[1:]) + 0.1 * u[0], **domain):
    return LatticeDesign(
        domain=DesignDomain(distance=box_distance(), lower=(0, 0, 0), upper=SIZE, **domain),
        cells=plain_cells(shape),
        cell_map=lambda p: np.asarray(p) / 4.0,
        cell_size=4.0,
        density=0.3,
    )


def volume(field, band=None):
    return float((field(grid()) < 0).mean() * SIZE.prod())


def top(points):
    """Distance to the face z = 8 mm."""
    away = np.maximum(
        np.abs(points[:2] - SIZE[:2, *[None] * (points.ndim - 1)] / 2).T - SIZE[:2] / 2, 0.0
    ).T
    return np.sqrt((away**2).sum(axis=0) + (points[2] - 8.0) ** 2)


@pytest.mark.parametrize("band", [None, 0.5])
def test_skin_on_one_face_has_the_volume_of_a_plate(band):
    """Area times thickness; counted in layers of 8 / 48 mm, of which 1.5 mm is a whole number."""
    field = lattice_field(design(components=(Skin(thickness=1.5, faces=top),)), band=band)
    assert volume(field) == pytest.approx(12 * 8 * 1.5, rel=1e-9)


@pytest.mark.parametrize("band", [None, 0.5])
def test_varying_skin_has_the_mean_volume(band):
    """0.5 to 2.5 mm along x on one face: 1.5 mm on average, in layers of 8 / 48 mm."""
    skin = Skin(thickness=2.5, thinnest=0.5, varying=lambda p: 0.5 + 2.0 * p[0] / 12.0, faces=top)
    d = design(components=(skin,))
    assert volume(lattice_field(d, band=band)) == pytest.approx(12 * 8 * 1.5, rel=0.01)
    points = np.array([[1.0, 11.0], [4.0, 4.0], [6.5, 6.5]])
    assert phase_at(d.domain, points).tolist() == [LATTICE, SKIN]


def test_joint_between_skin_and_wall_adds_what_its_law_says():
    """A wall of 4 mm in the middle meets the top skin at right angles, on both its sides."""
    radius = 1.2
    wall = lambda u: np.abs(u[0] - 1.5) - 0.5  # noqa: E731  distance in cells of 4 mm
    d = design(wall, components=(Skin(thickness=1.5, faces=top), Joint(radius=radius)))
    expected = 2 * (1 - np.pi / 4) * radius**2 * 8.0
    assert joint_volume(d) == pytest.approx(expected, rel=0.03)
    banded = lattice_field(d, band=0.4)
    exact = lattice_field(d)
    np.testing.assert_array_equal(banded(grid()) < 0, exact(grid()) < 0)


CASE = """\
[case]
name = "skinned"
[part]
box = ["12 mm", "8 mm", "8 mm"]
[region.top]
plane = "z = max"
[region.side]
plane = "y = min"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = 0.3
"""


def made(folder, more):
    (folder / "case.toml").write_text(CASE + more)
    return run(load_case(folder), build_registry(), folder=folder / "out")


def test_generated_skins_and_joints_are_in_the_file_and_said(tmp_path):
    folders = [tmp_path / name for name in ("sharp", "joined")]
    for folder in folders:
        folder.mkdir()
    skin = 'skin = [{thickness = "1 mm", faces = "top"}]\n'
    sharp, joined = (
        made(folder, skin + more)
        for folder, more in zip(folders, ("", 'joint_radius = "1 mm"\n'), strict=True)
    )
    # 1 of 8 mm is solid, the rest a lattice of 0.3.
    density = sharp.measures["density"]
    assert density["target"] == pytest.approx((1.0 + 7 * 0.3) / 8, abs=0.002)
    assert density["field"] == pytest.approx(density["target"], abs=0.015)
    assert sharp.measures["joints_mm3"] == 0.0
    added = joined.measures["volume_mm3"] - sharp.measures["volume_mm3"]
    assert added > 1.0
    # Of the field to its sampling; of the surface less, which chamfers edges without a joint too.
    of_field = (joined.measures["density"]["field"] - density["field"]) * 12 * 8 * 8
    assert joined.measures["joints_mm3"] == pytest.approx(of_field, rel=0.02)
    assert joined.measures["joints_mm3"] == pytest.approx(added, rel=0.06)
    result = json.loads((folders[1] / "out" / "result.json").read_text())
    assert result["measures"]["joints_mm3"] == joined.measures["joints_mm3"]


@pytest.mark.parametrize(
    ("skin", "words"),
    [
        ('"1 mm"', None),
        ('"none"', None),
        ('{thickness = ["1 mm", "2 mm"], formula = "1 + z / 8"}', None),
        ('{thickness = ["1 mm", "2 mm"]}', "a range needs a formula"),
        ('{thickness = ["2 mm", "1 mm"], formula = "1 + z / 8"}', "least thickness first"),
        ('{thickness = "1 mm", formula = "1 + z / 8"}', "found 1 mm with a formula"),
        ('{thickness = ["1 mm", "2 mm"], formula = "1 + d"}', 'unknown name "d"'),
        ('{thickness = "1 mm", faces = "tip"}', 'region "tip" is not defined'),
        ('[{thickness = "1 mm", faces = ["top", "tip"]}]', 'region "tip" is not defined'),
        ('{thickness = "4 mm"}', "less than 4 mm"),
        ('{thickness = "12 mm", faces = "top"}', "less than 12 mm"),
        ('"0 mm"', "above 0"),
        ("3", "found 3; expected a thickness"),
    ],
)
def test_keys_of_a_skin(tmp_path, skin, words):
    (tmp_path / "case.toml").write_text(CASE + f"skin = {skin}\n")
    if words is None:
        load_case(tmp_path)
        return
    with pytest.raises(CaseError, match=words):
        load_case(tmp_path)


def test_formula_outside_its_thickness_is_refused_with_the_place(tmp_path):
    with pytest.raises(CaseError, match=r"gives 2\.5 mm at \(12, .*expected 1 to 2 mm"):
        made(tmp_path, 'skin = {thickness = ["1 mm", "2 mm"], formula = "1 + x / 8"}\n')


def test_part_thinner_than_its_skin_is_said(tmp_path):
    """The top skin of 9 mm reaches through the box of 8 mm on half of it."""
    skin = '{thickness = ["1 mm", "9 mm"], formula = "clamp(2 * x - 4, 1, 9)", faces = "top"}'
    result = made(tmp_path, f"skin = {skin}\n")
    assert any("solid throughout" in w and "50" in w for w in result.warnings), result.warnings
