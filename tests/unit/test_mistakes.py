"""Mistakes in cases: each is told at its line and key, with its cause and a remedy."""

import subprocess
import sys
from dataclasses import replace
from datetime import date
from typing import get_args, get_origin

import pytest
from mistakes import BOXES, CHECKED, OF_CHECK, OF_STATED, STATED, TYPED
from pydantic import BaseModel

from gradedesign.common.values.suggest import described, meant
from gradedesign.design.case.read_case import load_case
from gradedesign.design.case.schema import CaseFile
from gradedesign.errors import CaseError
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.box import box_surface

LISTS = {
    "typed": ("check", CHECKED, TYPED),
    "check": ("check", CHECKED, OF_CHECK),
    "run of a stated density": ("run", STATED, OF_STATED),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """With the files that rows name, and a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    home = tmp_path / "case"
    home.mkdir()
    monkeypatch.chdir(tmp_path)
    for name, (edges, corner) in BOXES.items():
        box = box_surface(edges)
        write_stl(home / name, replace(box, vertices=box.vertices + corner))
    (home / "empty.stl").write_bytes(b"")
    (home / "case.obj").write_text("nothing")
    return home


def edited(base, mistake):
    """The case with the mistake, and the line that it stands in."""
    text = base
    for old, new in mistake.edits:
        if old:
            assert text.count(old) == 1, mistake
            text = text.replace(old, new)
        else:
            text += new
    rows = text.split("\n")
    marker = mistake.at or mistake.edits[0][1].rstrip("\n").split("\n")[-1]
    return text, max(n for n, row in enumerate(rows, start=1) if marker in row)


def wrong(told, mistake, line):
    """What is wrong with what was told; empty where nothing is."""
    place = f"case.toml:{line}" + (f": {mistake.key}: " if mistake.key else ":")
    if mistake.key or mistake.code:
        if place not in told:
            return f"no place {place!r}"
        first = next(row for row in told.split("\n") if place in row)
        if first.count(f"case.toml:{line}") != 1 or f"{mistake.key}: {mistake.key}:" in first:
            return "its place twice"
    plain = " ".join(told.split())
    for words in (mistake.cause, mistake.remedy):
        if " ".join(words.split()) not in plain:
            return f"no words {words!r}"
    return ""


@pytest.mark.parametrize(("command", "base", "mistakes"), LISTS.values(), ids=LISTS)
def test_every_mistake_is_told_as_a_person_needs_it(command, base, mistakes, folder, cli):
    options = ["--no-picture"] if command == "check" else ["-o", folder.parent / "made"]
    failing = []
    for mistake in mistakes:
        text, line = edited(base, mistake)
        (folder / "case.toml").write_text(text, encoding="utf-8")
        ended = cli(command, folder, *options)
        told = (ended.err if mistake.code else ended.out).replace(f"{folder}/", "")
        problem = wrong(told, mistake, line)
        if ended.code != mistake.code:
            problem = f"exit code {ended.code}, expected {mistake.code}"
        if problem:
            failing.append(f"{mistake.edits}\n  {problem}\n  {told[:500]}")
    assert not failing, f"{len(failing)} of {len(mistakes)}:\n" + "\n".join(failing)


def test_the_list_covers_what_it_says():
    rows = [*TYPED, *OF_CHECK, *OF_STATED]
    assert len(rows) >= 120
    assert all(len(of) == len({row.edits for row in of}) for _, _, of in LISTS.values())
    named = {row.key.split(".")[0].split("[")[0] for row in rows if row.key}
    assert set(CaseFile.model_fields) - {"output", "region"} <= named | {"output", "region"}
    assert all(row.cause and row.remedy for row in rows)


def tables(model, path=()):
    """Every key of a layout: the path of its table, of which ``[]`` marks a list."""
    for name, field in model.model_fields.items():
        key = field.alias or name
        yield (*path, key)
        nested = list(models(field.annotation))
        if nested and len(path) < 5:
            many = is_list(field.annotation)
            named = get_origin(field.annotation) is dict
            inner = (*path, key, *(("mine",) if named else ()), *(("[]",) if many else ()))
            yield from tables(nested[0], inner)


def models(annotation):
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models(argument)


def is_list(annotation):
    """Whether a list of tables is meant."""
    return any(
        get_origin(a) is tuple and list(models(a)) for a in (annotation, *get_args(annotation))
    )


def written(path):
    """Text that states a date for one key, its dotted path and its line."""
    value, dotted = date(1979, 5, 27).isoformat(), ""
    for n, part in enumerate(path):
        dotted += "[0]" if part == "[]" else f"{'.' if n else ''}{part}"
    *tables_around, key = path
    inner = f"{key} = {value}"
    for part in reversed(tables_around[1:]):
        inner = f"[{{{inner}}}]" if part == "[]" else inner
        if part != "[]":
            inner = f"{part} = {inner}" if inner[:1] == "[" else f"{part} = {{{inner}}}"
    if not tables_around:
        return f"# a date\n{key} = {value}\n", dotted, 2
    first = tables_around[0]
    if tables_around[1:2] == ["[]"]:
        inner = inner.removeprefix("[{").removesuffix("}]") if inner[:1] == "[" else inner
        return f"[[{first}]]\n# a date\n{inner}\n", dotted, 3
    return f"[{first}]\n# a date\n{inner}\n", dotted, 3


def test_every_key_of_the_schema_is_told_at_its_line(tmp_path):
    paths = list(dict.fromkeys(tables(CaseFile)))
    assert len(paths) > 150
    failing = []
    for path in paths:
        text, dotted, line = written(path)
        (tmp_path / "case.toml").write_text(text)
        with pytest.raises(CaseError) as caught:
            load_case(tmp_path)
        told = str(caught.value).split("\n")[1:]
        if not any(row.startswith(f"case.toml:{line}: {dotted}: ") for row in told):
            failing.append(f"{text}expected {line}: {dotted}\n" + "\n".join(told))
    assert not failing, f"{len(failing)} of {len(paths)}:\n" + "\n".join(failing[:5])


@pytest.mark.parametrize(
    ("command", "base"), [("check", CHECKED), ("run", CHECKED), ("run", STATED)]
)
@pytest.mark.parametrize(
    ("right", "mistake"), [('cell = "', "cell = "), ("[case]\nname", "[case]\nnames")]
)
def test_a_mistake_in_the_text_loads_nothing(command, base, right, mistake, tmp_path):
    """Neither plugins nor what they, solvers and fields are made of; seconds: benchmarks.

    An unknown key of [lattice] loads them: a component of a plugin may bring it.
    """
    (tmp_path / "case.toml").write_text(base.replace(right, mistake))
    script = (
        "import sys\n"
        "from gradedesign.program.commands import main\n"
        "try:\n"
        f"    main(['{command}', '{tmp_path}'])\n"
        "except SystemExit as ended:\n"
        "    heavy = ('numba', 'scipy', 'gradedesign_cells_tpms', 'vtk', 'trimesh', 'skfem')\n"
        "    print(ended.code, [name for name in heavy if name in sys.modules])\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert ended.stdout == "2 []\n", ended.stdout + ended.stderr
    assert "case.toml:" in ended.stderr


def test_no_word_is_guessed_from_nothing():
    assert meant("xyzzy", ["bcc", "octet"]) == ()
    assert meant("a", ["bcc", "abc"]) == ()
    assert described("of", {"bcc": "struts of a cube"}) == ()
