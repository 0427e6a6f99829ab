"""Text and tables at 80 columns: nothing is cut, no word broken, columns stay aligned."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import gradedesign
from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands import show
from gradedesign.program.commands.layout import table_lines, wrapped
from gradedesign.program.commands.run import print_verdict
from gradedesign.program.commands.show import without_noise

SUBMODELS = "explicit analysis times the ratio of 4 submodels"
ROWS = (
    LimitRow(
        key=LimitKey(kind="displacement"),
        name="displacement of lug_hole magnitude",
        load_case="pull sideways",
        value=0.1387,
        limit=0.14,
        unit="mm",
        judged_by="explicit analysis",
        band=Banded(value=0.1387, low=0.1372, high=0.1399, sizes_mm=(0.9, 0.6)),
    ),
    LimitRow(
        key=LimitKey(kind="stress"),
        name="stress in lattice",
        load_case="side",
        value=1555.5,
        limit=550.0,
        unit="MPa",
        judged_by=SUBMODELS,
    ),
)
WARNING = (
    "elements of 0.91 mm were refused: the mesh holds 12.3 mm^3 but its field 12.9 mm^3, a "
    "difference of 4.7 %; see /a/rather/long/path/without/a/single/blank/that/fits/into/no/line/of"
    "/eighty/columns.txt"
)


@pytest.fixture(autouse=True)
def eighty(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def result(**more):
    return RunResult(
        status="not_met",
        lightest=False,
        reason="stress in lattice (side) is 1556 MPa, 282.8% of the allowed 550 MPa, after 12 "
        "iterations; a higher upper density, smaller cells, a skin, or more iterations would help",
        limits=ROWS,
        mass_g=81.23,
        solid_mass_g=402.7,
        relative_density=0.2017,
        lattice_mass_g=60.1,
        lattice_density=0.214,
        warnings=(WARNING,),
        files={str(n): f"some-file-{n}.vtu" for n in range(12)},
        **more,
    )


def words_of(text):
    return text.replace("\u00a0", " ").split()


def test_a_result_fits_and_loses_no_word(capsys):
    print_verdict(result())
    printed = capsys.readouterr().out
    long = max(words_of(WARNING), key=len)
    for line in printed.splitlines():
        assert len(line) <= 80 or long in line, line
    assert words_of(result().reason) == words_of(printed)[1 : 1 + len(words_of(result().reason))]
    for word in (*words_of(WARNING), *(f"some-file-{n}.vtu" for n in range(11)), "lug_hole"):
        assert word.rstrip(",") in printed, word
    assert SUBMODELS in printed
    assert "BROKEN" in printed


def test_the_columns_of_limits_stay_aligned(capsys):
    show.print_limits(ROWS)
    lines = capsys.readouterr().out.splitlines()
    header = next(line for line in lines if "load case" in line)
    starts = [header.index(name) for name in ("limit", "load case")]
    body = lines[lines.index(header) + 1 : -2]
    for start in starts[1:]:
        assert {line[start - 1 : start] for line in body} <= {" ", ""}
    for unit in ("0.1399 mm", "0.14 mm", "1556 MPa", "550 MPa"):
        assert sum(unit in line for line in body) == 1  # a number stays with its unit
    assert any("99.9%" in line for line in body)
    assert lines[-1] == f"  [2] {SUBMODELS}"


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_a_table_is_never_wider_than_asked(width):
    rows = [("a word or two about it", "0.5 mm", "12"), ("short", "-", "1234.5")]
    lines = table_lines(("what it is about", "value of it", "n"), rows, width=width)
    assert max(map(len, lines)) <= width
    assert " ".join(lines).split().count("about") == 2
    ends = {len(line.rstrip()) for line in lines if line.rstrip().endswith(("12", "1234.5"))}
    assert len(ends) == 1  # numbers stand right


def test_a_table_that_fits_nowhere_becomes_blocks():
    rows = [("a-rather-long-name-of-a-thing", "another-one-that-is-as-long"), ("b", "c")]
    lines = table_lines(("first", "second"), rows, width=40)
    assert lines == [
        "  first   a-rather-long-name-of-a-thing",
        "  second  another-one-that-is-as-long",
        "",
        "  first   b",
        "  second  c",
    ]


def test_a_unit_stays_with_its_number():
    for width in range(20, 40):
        for line in wrapped("found 12 MPa beside 3.5 mm and 7 % more", width=width):
            assert not line.endswith(("12", "3.5", "7"))


def test_rounding_noise_beside_a_part_is_shown_as_zero():
    assert without_noise([-1.301e-15, 12.5, 25.0], 25.0) == [0.0, 12.5, 25.0]
    # What is small but no noise stays.
    assert without_noise([1e-6], 25.0) == [1e-6]


def test_a_result_at_the_prompt_of_python_is_one_screen_and_names_what_counts():
    rows = [replace(ROWS[0], value=100.0 + n, band=None) for n in range(40)]
    many = replace(
        result(case_name="lug", folder=Path("runs/lug")),
        limits=tuple(rows),
        warnings=(WARNING,) * 9,
    )
    shown = repr(many)
    assert len(shown.splitlines()) <= 24
    assert shown.startswith("<RunResult of case 'lug': not_met\n")
    for words in (many.reason, "mass 81.23 g of 402.7 g solid", "and 34 more limits",
                  "and 6 more warnings", "files in runs/lug>"):  # fmt: skip
        assert words in shown
    # The most used limit first, and the value that its utilisation counts.
    assert "): 139 of " in shown.splitlines()[3]
    high = replace(ROWS[0], band=Banded(value=100.0, low=90.0, high=110.0, sizes_mm=(2.0, 1.0)))
    row = repr(replace(many, limits=(high,)))
    assert f"): 110 of {high.limit:.4g} {high.unit}, {high.utilisation:.1%}" in row


def test_the_package_lists_its_public_names():
    # In a process of its own: what a test asked for before is no longer fetched when asked for.
    code = "import gradedesign; print(*dir(gradedesign))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.split() == sorted(gradedesign.__all__)
