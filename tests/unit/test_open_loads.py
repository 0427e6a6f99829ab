"""Loads on open lattice are told before a run; solid below them silences that."""

import pytest
from small_parts import box_part, held_bar

from gradedesign.case.read_case import load_case
from gradedesign.plugin.registry import build_registry
from gradedesign.resolve.resolved_case import resolve_case

CASE = (
    held_bar(
        box_part(60, 20, 20, 5),
        name="bar",
        material='name = "Ti-6Al-4V"',
        load_case="shear",
        force="0 N, 0 N, -400 N",
    )
    + """\
[limits]
safety_factor = 2
[lattice]
cell = "bcc"
size = "10 mm"
density = [0.2, 0.6]
"""
)
#: Solid at the loaded end, up to a height.
BOX = """\
[[keep]]
box = {{lower = ["59 mm", "-1 mm", "-1 mm"], upper = ["61 mm", "21 mm", "{height} mm"]}}
"""


def _warnings(tmp_path, more):
    path = tmp_path / "case.toml"
    path.write_text(CASE + more, encoding="utf-8")
    known = resolve_case(load_case(path), build_registry())
    return [text for text in known.warnings if "open lattice" in text]


def test_a_load_on_open_lattice_is_told(tmp_path):
    (text,) = _warnings(tmp_path, "")
    # All of the end face: no passive region, no skin.
    assert "(100% of its area)" in text
    assert '[[keep]] region = "' in text


@pytest.mark.parametrize(
    "more",
    [
        'skin = {thickness = "1 mm"}\n',
        '[[keep]]\nregion = "REGION"\nmargin = "1 mm"\n',
        BOX.format(height=21),
    ],
    ids=["skin", "margin", "box"],
)
def test_solid_below_the_load_is_no_open_lattice(tmp_path, more):
    loaded = load_case_regions(tmp_path)
    assert not _warnings(tmp_path, more.replace("REGION", loaded))


def test_a_box_that_covers_half_leaves_half_open(tmp_path):
    (text,) = _warnings(tmp_path, BOX.format(height=10))
    # 1000 points in two triangles, of whose rows of 1/23 of the face one may lie across the edge.
    share = float(text.split("(")[1].split("%")[0])
    assert share == pytest.approx(50, abs=5)


def load_case_regions(tmp_path):
    """Name of the loaded region."""
    path = tmp_path / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    return load_case(path).load_case[0].load[0].region
