"""Loads on open lattice are told before a run; solid below them silences that."""

import pytest
from small_parts import box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop.saturation import sentence
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.plan import resolve_case
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.host.registry import build_registry

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


def test_check_prints_the_plate_to_keep(tmp_path, cli):
    loaded = load_case_regions(tmp_path)
    path = tmp_path / "case.toml"
    plate = f'[[keep]] region = "{loaded}" with a margin of 1.7 mm or more makes a plate'
    ended = cli("check", path, "--no-picture")
    assert ended.code == 0
    assert plate in " ".join(ended.out.split())
    path.write_text(CASE + f'[[keep]]\nregion = "{loaded}"\nmargin = "1.7 mm"\n', encoding="utf-8")
    ended = cli("check", path, "--no-picture")
    assert ended.code == 0
    assert "open lattice" not in ended.out + ended.err


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


def test_a_limit_out_of_reach_is_told_where_a_plate_helps(tmp_path):
    loaded = load_case_regions(tmp_path)
    row = LimitRow(
        key=LimitKey(kind="displacement", region=loaded, component="magnitude", load_case="shear"),
        name=f"displacement of {loaded} magnitude",
        load_case="shear",
        value=2.0,
        limit=1.0,
        unit="mm",
        judged_by="explicit analysis",
    )
    plate = f'[[keep]] region = "{loaded}" with a margin of 1.7 mm or more'
    setup = prepare(load_case(tmp_path / "case.toml"), build_registry())
    assert plate in sentence(setup, row, 0.0)
    with (tmp_path / "case.toml").open("a", encoding="utf-8") as file:
        file.write(f'[[keep]]\nregion = "{loaded}"\nmargin = "1.7 mm"\n')
    setup = prepare(load_case(tmp_path / "case.toml"), build_registry())
    assert "[[keep]]" not in sentence(setup, row, 0.0)


def load_case_regions(tmp_path):
    """Name of the loaded region."""
    path = tmp_path / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    return load_case(path).load_case[0].load[0].region
