"""Size effects in a run: found without being asked, said in its result, and switched off."""

import pytest

from gradedesign import load_case, run
from gradedesign.common.system.progress import Event

# A bar one simple cubic cell thick and two wide, faces 1 mm outside the axes of its struts.
CASE = """\
[case]
name = "bar"
[part]
box = ["48 mm", "26 mm", "14 mm"]
mesh_size = "7 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "bend"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-10 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "sc"
size = "12 mm"
origin = ["1 mm", "1 mm", "1 mm"]
density = [0.29, 0.31]
phases = ["lattice"]
[run]
stop_after = "sizing"
[output]
formats = []
"""


def ran(folder, text):
    """Result of a run, and the messages of its stages by name."""
    folder.mkdir()
    (folder / "case.toml").write_text(text, encoding="utf-8")
    events: list[Event] = []
    result = run(load_case(folder), folder=folder / "run", on_event=events.append)
    return result, [(event.stage, event.message) for event in events]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return ran(tmp_path_factory.mktemp("bar") / "plain", CASE)


def test_a_run_knows_its_walls_without_being_asked(plain):
    result, _ = plain
    found = result.law["size_effects"]
    assert found["mode"] == "walls"
    # Across y and z, 2.2 and 1.2 cells; along x the bar is held and loaded, but its ends are free.
    share = found["share_of_lattice_in_walls_across"]
    assert (share["y"], share["z"]) == (1.0, 1.0)


def test_the_same_bar_moves_more_without_them(plain, tmp_path):
    off = CASE.replace("density =", "size_effects = false\ndensity =")
    result, _ = ran(tmp_path / "off", off)
    assert result.law["size_effects"] == {
        "mode": "periodic",
        "reason": "the case switches size effects off",
    }
    # Struts in the faces: a plate of one cell is more than twice as stiff in bending as the
    # periodic cell says (docs/validation.md, density 0.3: 2.2), a wider bar less.
    softer, stiffer = result.limits[0].value, plain[0].limits[0].value
    assert softer > 1.3 * stiffer
    assert not [w for w in result.warnings if "periodic lattice" in w]


def test_a_skin_leaves_them_out_with_a_sentence(tmp_path):
    result, events = ran(
        tmp_path / "skin", CASE.replace("density =", 'skin = {thickness = "1 mm"}\ndensity =')
    )
    told = [w for w in result.warnings if "takes it for a periodic lattice" in w]
    assert len(told) == 1
    assert "a skin ties the cells" in told[0]
    assert ("warning", told[0]) in events
    assert result.law["size_effects"]["mode"] == "periodic"


def test_a_part_of_many_cells_is_a_periodic_lattice(tmp_path):
    """36 mm of cells of 12 mm: three across, from which on the periodic lattice predicts better."""
    result, _ = ran(tmp_path / "thick", CASE.replace('"26 mm", "14 mm"', '"36 mm", "36 mm"'))
    found = result.law["size_effects"]
    assert (found["mode"], found["reason"]) == (
        "periodic",
        "half of the lattice has 3 cells across or more",
    )
    assert not [w for w in result.warnings if "periodic lattice" in w]
