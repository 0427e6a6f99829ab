"""`gradedesign new` with answers: the same whole case from options and from the dialogue."""

import json
import os
import select
import sys
import tomllib
from types import SimpleNamespace

import pytest
import trimesh

from gradedesign.design.check.proposals import Proposal, Proposals
from gradedesign.program.commands import new as new_command

#: Whole answers for the bar, as options.
OPTIONS = (
    *("--units", "mm", "--material", "Ti-6Al-4V", "--fix", "x_min"),
    *("--load", "x_max=0, 0, -500", "--safety-factor", "2", "--displacement", "x_max=0.1"),
    *("--min-wall", "0.5", "--cell", "gyroid-sheet", "--size", "8"),
)
#: The same by the dialogue. Regions by number in the order of their names: x_max is the first and
#: x_min the second; gyroid-sheet is the strongest cell at density 0.2 and stands first.
LINES = (
    *("mm", "Ti-6Al-4V", "2", "1", "0 0 -500", "", "2"),
    *("0.1 mm", "0.5", "1", "8", "n"),
)


@pytest.fixture
def bar(tmp_path, monkeypatch):
    """A bar of 30 x 12 x 12 mm in a file without a unit, in the working folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(new_command, "picture_loads", lambda *_, **__: ())
    trimesh.creation.box((30.0, 12.0, 12.0)).export("bar.stl")
    return "bar.stl"


@pytest.fixture
def terminal(monkeypatch):
    """Somebody who types lines at a terminal, and what they were asked; Ctrl-D after the last."""

    def types(*lines):
        left = list(lines)

        def read(prompt):
            assert prompt == "> "
            if not left:
                raise EOFError
            return left.pop(0)

        monkeypatch.setattr(new_command, "on_terminal", lambda: True)
        monkeypatch.setattr("builtins.input", read)
        return left

    return types


def case_text(folder="bar"):
    return (new_command.Path(folder) / "case.toml").read_text(encoding="utf-8")


def test_options_state_a_whole_case(cli, bar):
    ended = cli("new", bar, *OPTIONS)
    assert ended.code == 0, ended.err
    text = case_text()
    assert "?" not in text
    data = tomllib.loads(text)
    assert data["material"] == {"name": "Ti-6Al-4V"}
    assert data["load_case"][0]["fix"] == [{"region": "x_min"}]
    assert data["load_case"][0]["load"] == [{"region": "x_max", "force": ["0 N", "0 N", "-500 N"]}]
    assert data["limits"]["safety_factor"] == 2
    assert data["limits"]["displacement"] == [{"region": "x_max", "magnitude": "0.1 mm"}]
    assert data["print"] == {"min_wall": "0.5 mm"}
    # Half of a cell of 8 mm, and a sixth of it behind the loaded face.
    lattice = {"cell": "gyroid-sheet", "size": "8 mm", "least_member": "4 mm"}
    assert data["lattice"] == {**lattice, "phases": ["lattice", "solid"]}
    assert data["keep"] == [{"region": "x_max", "margin": "1.3 mm"}]
    assert "Next: gradedesign preview bar, gradedesign run bar" in ended.out
    # The window in the comment is what a check finds, too.
    checked = json.loads(cli("check", "bar", "--json", "--no-picture").out)
    (line,) = (row for row in text.splitlines() if row.startswith("# density = "))
    stated = tomllib.loads(line.removeprefix("# "))["density"]
    assert stated == pytest.approx(checked["prediction"]["density"], rel=5e-3)


def test_the_dialogue_writes_the_same_case(cli, bar, terminal):
    assert cli("new", bar, *OPTIONS, "-o", "typed").code == 0
    left = terminal(*LINES)
    ended = cli("new", bar)
    assert (ended.code, left) == (0, []), ended.err
    assert case_text() == case_text("typed")
    # It tells the options that do so.
    told = " ".join(ended.out.partition("by one command:")[2].partition("Next:")[0].split())
    words = told.replace("\\ ", "").split("gradedesign new ")[1].replace("'", "")
    assert words == (
        "bar.stl --units mm --material Ti-6Al-4V --fix x_min --load x_max=0 0 -500 "
        "--safety-factor 2 --displacement x_max=0.1 mm --min-wall 0.5 --cell gyroid-sheet --size 8"
    )
    assert max(map(len, ended.out.splitlines())) <= 80


def test_enter_takes_what_is_proposed_and_says_why(cli, bar, terminal):
    # Nothing can be proposed for the force.
    left = terminal("", "", "", "", "0,0,-500", "", "", "", "", "", "", "n")
    ended = cli("new", bar)
    assert (ended.code, left) == (0, []), ended.err
    words = " ".join(ended.out.split())
    for reason in (
        "Enter: mm, then 30 x 12 x 12 mm; first of mm, inch, cm, m, um to make it 10 to 2000 mm",
        "Enter: Ti-6Al-4V, 3 installed printing processes were measured with it",
        "Enter: z_min, the largest flat face",
        "Enter: x_min, the flat face farthest from it",
        "Enter: 2, half of the yield strength may be used",
        "Enter: no limit, the safety factor alone decides",
        "Enter: not stated, the cell alone sets it",
        "Enter: gyroid-sheet, 6.8% of the solid's strength at density 0.2",
        # 2 V / A = 2 * 4320 / 1728 = 5 mm.
        "Enter: 5 mm, half of the part's mean thickness: two cells across",
    ):
        assert reason in words
    data = tomllib.loads(case_text())
    assert "displacement" not in data["limits"]
    assert "print" not in data
    assert data["lattice"]["size"] == "5 mm"
    assert "?" not in case_text()


def test_holes_alone_are_proposed_for_bolts_and_pins():
    """Roundings and slots are no place for either, however many or large they are."""

    def shape(kind, count, diameter, area):
        return SimpleNamespace(kind=kind, count=count, diameter=diameter, area=area)

    shapes = {
        "bolts": shape("hole", 4, 6.0, 300.0),
        "seats": shape("hole", 4, 11.0, 500.0),
        "corners": shape("inner rounding", 8, 3.0, 90.0),
        "pin": shape("hole", 1, 10.0, 400.0),
        "slot": shape("slot", 1, 20.0, 900.0),
    }
    proposals = Proposals(draft=SimpleNamespace(shapes=shapes, regions={}), registry=None)
    assert proposals.support() == Proposal(name="bolts", why="4 equal holes, as for bolts")
    assert proposals.load({"bolts"}).name == "pin"


@pytest.mark.parametrize(
    ("option", "text", "words"),
    [
        ("--material", "Ti64", "no material named 'Ti64'; did you mean"),
        ("--fix", "x_mni", 'region "x_mni" is not defined; did you mean "x_min"?'),
        ("--load", "x_max", "type REGION=FX,FY,FZ in N, such as x_min=0,0,-500"),
        ("--load", "x_max=0,0", "expected three entries for x, y and z"),
        ("--load", "x_max=0,0,5 mm", 'entry 3: found "5 mm", which is a length; expected a force'),
        ("--load", "x_max=0,0,0", "loads nothing"),
        ("--safety-factor", "0.5", "found 0.5; expected a value at least 1"),
        ("--safety-factor", "two", "type a number such as 2"),
        ("--displacement", "x_max=-1", 'found "-1 mm"; expected a length above 0'),
        ("--min-wall", "thin", 'found "thin", which is not a number followed by a unit'),
        ("--cell", "gyroid", "did you mean"),
        ("--size", "0", "type a length in mm, such as 8"),
        ("--units", "inches", 'did you mean "inch"?'),
    ],
)
def test_a_wrong_answer_is_refused_with_what_to_type(cli, bar, tmp_path, option, text, words):
    others = dict(zip(OPTIONS[::2], OPTIONS[1::2], strict=True))
    ended = cli("new", bar, *(w for pair in {**others, option: text}.items() for w in pair))
    assert ended.code == 2
    assert words in ended.err
    assert ended.err.startswith(f"error: {option}: ")
    assert [path.name for path in tmp_path.iterdir()] == [bar]


def test_the_dialogue_asks_again_until_an_answer_is_right(cli, bar, terminal):
    left = terminal(
        *("furlong", "mm", "Ti64", "", "x_mni", "2", "7", "1", "0 0", "0 0 -500", ""),
        *("half", "2", "far", "", "", "gyroid", "1", "tiny", "8", "maybe", "n"),
    )
    ended = cli("new", bar)
    assert (ended.code, left) == (0, []), ended.err
    words = " ".join(ended.out.split())
    for told in (
        'found "furlong"', "no material named 'Ti64'", '"x_mni" is not defined',
        'no region "7"', "expected three entries", 'found "half"', 'found "far"',
        "no cell family named 'gyroid'", 'found "tiny"',
    ):  # fmt: skip
        assert told in words


def test_what_is_not_answered_stays_open(cli, bar, terminal):
    terminal("mm", "Ti-6Al-4V", "x_min")
    ended = cli("new", bar)
    assert ended.code == 0
    data = tomllib.loads(case_text())
    assert data["material"]["name"] == "Ti-6Al-4V"
    assert data["load_case"][0]["fix"] == [{"region": "x_min"}]
    assert data["load_case"][0]["load"][0]["region"] == "?"
    assert "load_case[0].load[0].force" in ended.out
    assert cli("new", bar, *OPTIONS[:6], "-o", "typed").code == 0
    assert case_text("typed") == case_text()
    told = cli("new", bar, *OPTIONS[:6], "-o", "other", "--estimate").err
    assert "--estimate goes with all of --material, --fix, --load" in told


@pytest.mark.parametrize("option", ["--no-ask", "--dry-run", "--json"])
def test_nobody_is_asked(cli, bar, terminal, option):
    terminal()
    ended = cli("new", bar, "--units", "mm", option)
    assert ended.code == 0
    assert "Enter:" not in ended.out
    assert cli("new", bar, "--no-ask", "-o", "other").code == 2


def test_displacements_alone_may_be_limited(cli, bar):
    without = [w for w in OPTIONS if w not in ("--safety-factor", "2")]
    assert cli("new", bar, *without).code == 0
    limits = tomllib.loads(case_text())["limits"]
    assert limits == {"displacement": [{"region": "x_max", "magnitude": "0.1 mm"}]}


def test_masses_are_predicted_when_they_are_wanted(cli, bar, terminal, monkeypatch):
    """The bodies of a check, here made up: what predicts them has its own tests."""
    body = SimpleNamespace(name="graded lattice", mass_g=7.5, largest_utilisation=1.0, words="")
    answer = SimpleNamespace(
        constant=(), governing=None, sized_mass_g=None, feasible=True, bodies=[body],
        why_lattice="", run_s={"graded lattice": 90.0},
    )  # fmt: skip
    asked = []
    monkeypatch.setattr(new_command, "estimated", lambda case, *_: asked.append(case) or answer)
    terminal(*LINES[:-1], "")
    ended = cli("new", bar)
    assert "graded lattice     7.5           100.0%     90 s" in ended.out
    assert cli("new", bar, *OPTIONS, "-o", "typed", "--estimate").code == 0
    assert [case.material.name for case in asked] == ["Ti-6Al-4V"] * 2


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
@pytest.mark.slow
def test_a_terminal_is_seen_as_one(bar):
    """The whole dialogue through a pseudo-terminal, then Ctrl-C in a second one."""
    import pty

    def talk(*lines):
        child, end = pty.fork()
        if child == 0:
            words = [sys.executable, "-m", "gradedesign", "new", bar]
            os.execv(sys.executable, words)
        left, heard = list(lines), b""
        while select.select([end], [], [], 120.0)[0]:
            try:
                heard += os.read(end, 4096)
            except OSError:
                break
            if heard.endswith(b"\n> ") and left:
                os.write(end, left.pop(0).encode())
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), heard.decode()

    code, heard = talk("mm\n", "\n", "\x03")
    assert (code, "holds what was answered" in heard) == (130, True)
    assert 'name = "Ti-6Al-4V"' in case_text()
    for path in new_command.Path("bar").iterdir():
        path.unlink()
    code, heard = talk(*(f"{line}\n" for line in LINES))
    assert code == 0, heard
    assert "?" not in case_text()
