"""The README and the Makefile say what the program does."""

import ast
import inspect
import re
import tomllib
import typing
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.main import get_command

from gradedesign import errors, load_case, run
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.design.verdict import reasons
from gradedesign.errors import GradeDesignError
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.program.commands.app import app
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.run import print_verdict

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_command_and_option_of_the_table_exists():
    rows = re.findall(r"^\| `gradedesign (\w+)([^`]*)`", README, flags=re.MULTILINE)
    group = get_command(app)
    commands = {name: group.get_command(None, name) for name in group.list_commands(None)}
    assert {name for name, _ in rows} == set(commands)
    for name, rest in rows:
        options = {word for p in commands[name].params for word in p.opts}
        assert set(re.findall(r"-{1,2}[a-z-]+", rest)) <= options


def test_every_exit_code_is_explained():
    codes = {e.exit_code for e in vars(errors).values() if hasattr(e, "exit_code")}
    assert issubclass(errors.CaseError, GradeDesignError)
    told = {int(n) for cell in re.findall(r"^\| ([\d, ]+) \|", README, flags=re.MULTILINE)
            for n in cell.split(",")}  # fmt: skip
    assert codes | {0, 1, 4, 130} == told


def test_it_opens_with_the_two_commands():
    assert README.index("make run") < README.index("make test") < README.index("pip install")


def test_links_lead_somewhere():
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    missing = [link for link in links if not (ROOT / link).exists()]
    # The picture of the bracket is made by its run.
    assert set(missing) <= {"docs/pictures/bracket.png", "docs/homogenisation.md"}


def test_every_dependency_is_in_the_list_of_third_parties():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    listed = (ROOT / "THIRD_PARTY.md").read_text(encoding="utf-8")
    for line in project["dependencies"]:
        name, minimum = re.match(r"([\w-]+)>=([\d.]+)", line).groups()
        assert f"| {name} | >= {minimum} |" in listed
    for lines in project["optional-dependencies"].values():
        for line in lines:
            assert re.match(r"[\w-]+", line)[0] in listed


def test_the_build_calls_the_tests():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert script.rstrip().endswith("make test")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in ("install", "run", "test", "test-all", "bench"):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


def block(language, words):
    """The one fenced block of a language in the README that holds these words."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
    (found,) = (text for text in blocks if words in text)
    return found


#: Names as in cases/bracket, so that lines about them read as the README's.
CASE = """
[case]
name = "bracket"
[part]
box = ["30 mm", "10 mm", "10 mm"]
mesh_size = "10 mm"
[region.bolts]
plane = "x = min"
[region.lug_hole]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "pull"
fix = [{region = "bolts"}]
load = [{region = "lug_hole", force = ["0 N", "0 N", "10 N"]}]
[limits]
displacement = [{region = "lug_hole", magnitude = "0.14 mm"}]
[lattice]
cell = "sc"
size = "10 mm"
density = [0.12, 0.60]
[run]
stop_after = "solid"
[output]
formats = ["report"]
"""


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A folder in which cases/bracket is a small box that is analysed solid."""
    folder = tmp_path / "cases" / "bracket"
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def test_the_python_snippet_runs(small, capsys):
    code = block("python", "gradedesign.run(")
    (path,) = re.findall(r'load_case\("([^"]+)"\)', code)
    assert (ROOT / path / "case.toml").is_file()
    names = {}
    exec(code, names)
    assert names["result"].status == "partial"
    printed = capsys.readouterr().out.splitlines()
    assert any(line.startswith("solid displacement of lug_hole") for line in printed)
    assert printed[-1].startswith("partial None [('displacement of lug_hole magnitude', 0.")


#: Of the table of limits.
TITLE = "Limits, by the unfavourable ends of their bands"


def shape(text):
    """A text in one line, with # for every number."""
    return re.sub(r"[+-]?\d+([.:]\d+)*(e[+-]?\d+)?%?", "#", " ".join(text.split()))


def filled(record, count):
    """A record of numbers, whatever its fields."""
    values = {int: 3, float: 2.5, bool: True, tuple[float, ...]: (2.5,) * count,
              Mapping[str, float]: {}, tuple[LimitIteration, ...]: ()}  # fmt: skip
    hints = typing.get_type_hints(record)
    return record(**{name: values[typing.get_args(h)[0] if h == float | None else h]
                     for name, h in hints.items()})  # fmt: skip


def sentences(module):
    """Texts that a module writes, with # for what is filled in."""
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.JoinedStr):
            parts = (getattr(part, "value", "") for part in node.values)
            yield "".join(part if isinstance(part, str) else "#" for part in parts)


def test_the_terminal_sample_reads_as_what_is_printed(small, capsys):
    case = load_case("cases/bracket")
    result = run(case, on_event=ProgressLines())
    band = Banded(value=0.1, low=0.1, high=0.1)
    rows = tuple(replace(row, band=band, converges=True) for row in result.limits)
    key = LimitKey(kind="stress", region="lattice")
    rows += (replace(rows[0], key=key, name="stress in lattice", unit="MPa"),)
    limits = tuple(
        LimitIteration(
            key=r.key, name=r.name, unit=r.unit, predicted=1, explicit=2, discrepancy=1, factor=1
        )
        for r in rows
    )
    announce = Announcer(ProgressLines())
    announce.iteration(
        SimpleNamespace(
            summary=replace(filled(Iteration, 1), limits=limits),
            rows=rows,
            expected={row.key: 1.07 for row in rows},
        )
    )
    sample = block("text", f"{TITLE}\n").splitlines()
    (verdict,) = (text for text in paragraphs(sample) if text.startswith("MET, lightest: "))
    reason = verdict.removeprefix("MET, lightest: ")
    assert shape(reason) in set(sentences(reasons))
    masses = dict.fromkeys(
        ("mass_g", "solid_mass_g", "relative_density", "lattice_mass_g", "lattice_density"), 2.5
    )
    print_verdict(
        replace(result, status="met", lightest=True, reason=reason, limits=rows, **masses)
    )
    printed = shape(capsys.readouterr().out)
    # Lines are wrapped at 80 columns, so that paragraphs and rows are compared without line ends.
    for text in paragraphs(sample):
        assert shape(text).removesuffix(" ...") in printed, text
    head = sample.index(TITLE) + 1
    # A header that is wider than its column stands in two lines.
    assert set(sample[head].split()) <= set(printed.split())
    cells = {word for line in sample[head + 1 :] if line.startswith("  ") for word in line.split()}
    assert {"pull", "side", "holds", "[1]", "[2]"} <= cells
    assert max(map(len, sample)) <= 80


def paragraphs(lines):
    """Lines joined with those that go on from them, without the table of limits and "..."."""
    found = []
    for line in lines[: lines.index(TITLE)]:
        if line.startswith("  "):
            found[-1] += " " + line
        elif line != "...":
            found.append(line)
    # What a step is doing is said by many; what stands in the sample is one of them.
    return [text for text in found if "at most" not in text]
