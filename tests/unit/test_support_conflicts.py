"""Supports that contradict each other on touching regions are refused without a mesh."""

import numpy as np
import pytest
from small_parts import box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.support_conflicts import common_point, require_agreeing
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region

CASE = (
    held_bar(
        box_part(60, 40, 20, 10),
        regions="""\
[region.floor]
plane = "z = min"
[region.half]
all = ["floor", "right"]
[region.right]
box = {lower = ["30 mm", "-1 mm", "-1 mm"], upper = ["61 mm", "41 mm", "21 mm"]}
clip = true
[region.patch]
plane = "z = min"
box = {lower = ["10 mm", "10 mm", "-1 mm"], upper = ["20 mm", "30 mm", "1 mm"]}
clip = true
[region.beside]
plane = "z = min"
box = {lower = ["20 mm", "15 mm", "-1 mm"], upper = ["30 mm", "25 mm", "1 mm"]}
clip = true
[region.across]
plane = "z = min"
box = {lower = ["5 mm", "18 mm", "-1 mm"], upper = ["25 mm", "22 mm", "1 mm"]}
clip = true
""",
    )
    + """\
[limits]
displacement = [{region = "tip", magnitude = "2 mm"}]
[lattice]
cell = "walls"
size = "10 mm"
"""
)
ROOT = '{region = "root"}'
MOVED = 'displacement = ["free", "free", "0.1 mm"]'
CLAMPED = 'displacement = ["0 mm", "0 mm", "0 mm"]'


def case_with(folder, *supports):
    entries = ",\n  ".join(supports)
    assert CASE.count(f"fix = [{ROOT}]") == 1
    (folder / "case.toml").write_text(CASE.replace(f"fix = [{ROOT}]", f"fix = [\n  {entries}\n]"))
    case = load_case(folder)
    return case, part_of(case, {})


def line(case, text):
    return case.path.read_text().split("\n").index(text) + 1


CONTRADICTING = {
    # Root and floor share the edge x = z = 0.
    "edge": (ROOT, f'{{region = "floor", {MOVED}}}'),
    # A clamped patch in the middle of a face, no corner of which is one of the face.
    "patch in a face": (f'{{region = "floor", {MOVED}}}', f'{{region = "patch", {CLAMPED}}}'),
    "cut borders": (f'{{region = "patch", {MOVED}}}', f'{{region = "beside", {CLAMPED}}}'),
    # A plus: no corner of either lies in the other, but for those of triangles they are cut into.
    "crossing": (f'{{region = "patch", {MOVED}}}', f'{{region = "across", {CLAMPED}}}'),
    "one region twice": (f'{{region = "floor", {MOVED}}}', f'{{region = "floor", {CLAMPED}}}'),
}


@pytest.mark.parametrize("supports", CONTRADICTING.values(), ids=CONTRADICTING)
def test_both_lines_are_named(tmp_path, supports):
    case, part = case_with(tmp_path, *supports)
    with pytest.raises(CaseError) as caught:
        require_agreeing(case.load_case, part, case.where)
    message = str(caught.value)
    first, second = (line(case, f"  {s}{end}") for s, end in zip(supports, (",", ""), strict=True))
    assert message.startswith(f"case.toml:{second}: load_case[0].fix[1]: load case 'pull'")
    assert f"(case.toml:{first}: load_case[0].fix[0])" in message
    assert "z displacement" in message
    assert "0.1 mm" in message
    assert "and the two regions meet, as at (" in message


AGREEING = {
    "same value": (ROOT, '{region = "floor", displacement = ["free", "free", "0 mm"]}'),
    "other components": (
        '{region = "root", components = "xy"}',
        f'{{region = "floor", {MOVED}}}',
    ),
    # 30 mm of the floor lie between them.
    "apart": (ROOT, f'{{region = "half", {MOVED}}}'),
    "opposite faces": (ROOT, f'{{region = "tip", {MOVED}}}'),
}


@pytest.mark.parametrize("supports", AGREEING.values(), ids=AGREEING)
def test_supports_that_can_hold_together_pass(tmp_path, supports):
    case, part = case_with(tmp_path, *supports)
    require_agreeing(case.load_case, part, case.where)


@pytest.mark.parametrize("gap", [-1e-3, 1e-3])
def test_pieces_that_cross_without_a_corner_in_common(gap):
    """Two strips of one triangle, as a plus, and moved apart by a thousandth of a mm."""

    def strip(name, *corners):
        return Region(
            name=name, triangles=np.array([3]), corners=np.array([corners], float),
            area=1.0, centroid=np.zeros(3), faces=(0,),
        )  # fmt: skip

    along = strip("along", (0, 4, 0), (9, 4, 0), (9, 4.1, 0))
    x = 9 + gap if gap > 0 else 8.0
    across = strip("across", (x, 0, 0), (x + 0.1, 0, 0), (x, 9, 0))
    assert (common_point(along, across, 1e-9) is None) == (gap > 0)
