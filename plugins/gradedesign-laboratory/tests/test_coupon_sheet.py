"""Sheets of coupons: read back as they were filled in, or refused with line, column and reason."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign import CaseError, load_case
from gradedesign.commands import build_registry, fitting_part, stated_lattice
from gradedesign_laboratory.coupon_plate import PlacedBlock
from gradedesign_laboratory.coupon_readings import read_sheet, readings_of
from gradedesign_laboratory.coupon_sheet import (
    COLUMNS,
    DESIGNED,
    OF_BLOCKS,
    PlateFacts,
    sheet_text,
)
from gradedesign_laboratory.coupons import Block, Struts

BLANK = sheet_text(
    PlateFacts(process="m290-ti64", material="Ti-6Al-4V", cell="octet"),
    [
        PlacedBlock(
            block=Block(number=n, density=0.25, size=4.0, cells=3), volume=855.198, plates=422.28,
            as_built=None, ratio=1.11648,
        )
        for n in (1, 2)
    ],
    [
        Struts(number=3, inclination=0.0, width=0.5, count=2),
        Struts(number=4, inclination=45.0, width=0.5, count=2),
    ],
)  # fmt: skip
FIRST_ROW = 10


def filled(changes=(), facts=(), text=BLANK, separator=","):
    """The sheet with cells by (row from 0, column), and facts, replaced."""
    rows = list(csv.reader(io.StringIO(text)))
    stated = {"machine": "EOS M 290", "date": "2026-11-27", "gauge_mm": "", **dict(facts)}
    for row in rows:
        name = row[0].lstrip("# ")
        if name in stated and row[0].startswith("#"):
            row[1:] = [stated[name]]
    for (row, column), value in dict(changes).items():
        rows[FIRST_ROW - 1 + row][COLUMNS.index(column)] = value
    out = io.StringIO()
    csv.writer(out, delimiter=separator, lineterminator="\n").writerows(rows)
    return out.getvalue()


def problem(text):
    with pytest.raises(CaseError) as error:
        readings_of(text, "sheet.csv")
    return str(error.value)


MEASURED = {
    (0, "mass_g"): "3.7711", (0, "modulus_MPa"): "6700", (0, "yield_MPa"): "55.2",
    (0, "x_mm"): "12.03", (2, "width_mm"): "0.581", (5, "width_mm"): "5.5e-1",
    (1, "remarks"): "fell, = lost; 3,5 mm",
}  # fmt: skip


def test_a_sheet_is_read_as_it_was_filled_in():
    found = readings_of(filled(MEASURED, {"gauge_mm": "0.004"}), "sheet.csv")
    assert (found.machine, found.day, found.gauge) == ("EOS M 290", "2026-11-27", 0.004)
    assert found.facts == PlateFacts(process="m290-ti64", material="Ti-6Al-4V", cell="octet")
    assert [(s.coupon, s.strut, s.inclination, s.designed, s.width) for s in found.struts] == [
        (3, 1, 0.0, 0.5, 0.581), (3, 2, 0.0, 0.5, None),
        (4, 1, 45.0, 0.5, None), (4, 2, 45.0, 0.5, 0.55),
    ]  # fmt: skip
    first, second = found.blocks
    assert (first.mass, first.modulus, first.strength) == (3.7711, 6700.0, 55.2)
    assert first.edges == (12.03, None, None)
    assert (first.designed, first.plates, first.ratio) == (855.198, 422.28, 1.11648)
    assert (second.mass, second.modulus, second.edges) == (None, None, (None, None, None))


def test_a_sheet_that_a_spreadsheet_saved_again_is_the_same():
    """Semicolons, decimal commas throughout, rows sorted otherwise, blanks to the last column."""
    plain = readings_of(filled(MEASURED), "sheet.csv")
    rows = list(csv.reader(io.StringIO(filled(MEASURED))))
    body = [[cell.replace(".", ",") for cell in row] for row in rows[FIRST_ROW - 1 :]]
    rows = [
        [*row, *[""] * (len(COLUMNS) - len(row))] for row in (*rows[: FIRST_ROW - 1], *body[::-1])
    ]
    out = io.StringIO()
    csv.writer(out, delimiter=";", lineterminator="\r\n").writerows(rows)
    assert readings_of(out.getvalue(), "sheet.csv") == plain
    tabs = filled(MEASURED, separator="\t")
    assert readings_of(tabs, "sheet.csv") == plain


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({(2, "width_mm"): "0.58 mm"}, 'csv:12: width_mm: found "0.58 mm"; expected a number'),
        ({(2, "width_mm"): "581"}, 'width_mm: found "581"; the designed value is 0.5; is its unit'),
        ({(2, "width_mm"): "-0.58"}, "expected a number above 0, or a blank"),
        ({(2, "width_mm"): "0"}, "expected a number above 0"),
        ({(2, "width_mm"): "=A1*2"}, "a formula; save the sheet with values"),
        ({(2, "width_mm"): "+=A1"}, "a formula"),
        ({(2, "width_mm"): "@SUM(A1)"}, "a formula"),
        ({(0, "modulus_MPa"): "6,700"}, "decimal commas, so that the point may part thousands"),
        ({(0, "modulus_MPa"): "6 700"}, "separators of thousands"),
        ({(0, "modulus_MPa"): "1.234.567"}, "separators of thousands"),
        ({(0, "mass_g"): "nan"}, "expected a number alone"),
        ({(0, "mass_g"): "inf"}, "expected a number alone"),
        ({(0, "mass_g"): "٣"}, "expected a number alone"),
        ({(0, "width_mm"): "0.5"}, "width_mm does not belong to a block: found \"0.5\""),
        ({(2, "mass_g"): "0.5"}, "mass_g does not belong to a strut"),
        ({(1, "coupon"): "1"}, "sheet.csv:11: coupon 1: stands in line 10 already"),
        ({(3, "strut"): "1"}, "coupon 3, strut 1: stands in line 12 already"),
        ({(3, "strut"): ""}, "strut: found \"\"; expected a number from 1"),
        ({(3, "kind"): "rod"}, "kind: found \"rod\"; expected block or strut"),
        ({(3, "designed_width_mm"): "0.6"}, "what the plate states has changed"),
        ({(3, "inclination_deg"): ""}, "inclination_deg: blank; expected it as the plate stated"),
    ],
)  # fmt: skip
def test_what_is_no_measurement_is_refused(changes, words):
    assert words in problem(filled({**MEASURED, **changes}))


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"machine": ""}, "sheet.csv:5: machine: blank"),
        ({"machine": "=1+1"}, "expected the name of a machine"),
        ({"date": ""}, "sheet.csv:6: date: blank; expected year, month and day"),
        ({"date": "27.11.2026"}, 'found "27.11.2026"; expected year, month and day'),
        ({"gauge_mm": "4 um"}, 'sheet.csv:7: gauge_mm: found "4 um"'),
        ({"process": "other"}, "what the plate states has changed"),
    ],
)
def test_facts_that_the_record_states_must_be_there(facts, words):
    assert words in problem(filled(MEASURED, facts))


def renamed(column, name):
    """The sheet with another name in its header."""
    header = ",".join(COLUMNS)
    assert header in filled(MEASURED)
    other = ",".join(name if one == column else one for one in COLUMNS)
    return filled(MEASURED).replace(header, other)


@pytest.mark.parametrize("column", COLUMNS[:-1])
def test_every_missing_or_renamed_column_is_named(column):
    assert f"column {column} is missing" in problem(renamed(column, ""))
    other = column.replace("_mm", "_um").replace("_MPa", "_GPa").replace("_g", "_kg")
    if other != column:
        assert f'found column "{other}"; did you mean' in problem(renamed(column, other))
    assert f"column {column} stands there twice" in problem(renamed("remarks", column))


def test_rows_that_are_gone_or_new_are_told():
    lines = filled(MEASURED).splitlines()
    assert "rows are missing or added" in problem("\n".join(lines[:-1]))
    assert "rows are missing or added" in problem(
        "\n".join([*lines, lines[-1].replace("4,2", "4,3")])
    )
    assert "beyond the columns" in problem("\n".join([*lines[:-1], lines[-1] + ",,7"]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "does not begin with"),
        ("coupon,strut\n1,2\n", "does not begin with"),
        ("# gradedesign coupons,2\n", "does not begin with"),
        ("# gradedesign coupons,1\n", "'# process' is missing"),
        (BLANK.split("coupon,")[0], "no header with rows"),
        (BLANK.replace("# cell", "# cel"), 'found "# cel"; did you mean "cell"'),
        (BLANK.replace("# machine,", "# machine,a\n# machine,b"), "machine: stated twice"),
        (BLANK.replace("# machine,", "# machine,a,b"), "machine: found several values"),
        (BLANK + '5,"', "not a row of values"),
    ],
)
def test_what_is_no_sheet_is_refused(text, words):
    assert words in problem(text)


def test_files_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "sheet.csv"
    with pytest.raises(CaseError, match="cannot be read"):
        read_sheet(path)
    path.write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(CaseError, match="not UTF-8 text, byte 0xff; save it as CSV UTF-8"):
        read_sheet(path)
    path.write_bytes(b"1" * 1_000_001)
    with pytest.raises(CaseError, match="larger than 1 MB"):
        read_sheet(path)
    path.write_bytes(b"\xef\xbb\xbf" + filled(MEASURED).encode())
    assert read_sheet(path).machine == "EOS M 290"


NUMBERS = st.floats(min_value=0.11, max_value=2.4).map(lambda v: f"{v:.6g}")


@given(widths=st.lists(st.one_of(st.just(""), NUMBERS), min_size=4, max_size=4))
def test_every_number_comes_back(widths):
    changes = {(2 + k, "width_mm"): width for k, width in enumerate(widths)}
    found = [strut.width for strut in readings_of(filled(changes), "sheet.csv").struts]
    assert found == [float(width) if width else None for width in widths]


JUNK = st.one_of(
    st.text(max_size=12),
    st.sampled_from(
        ["=1+1", "1,2", "1.2", "1e5", "1e999", "-3", "0", "nan", "ｱ", "1\n2", '"', "#"]
    ),
    st.floats().map(str),
)


@settings(max_examples=150)
@given(
    row=st.integers(0, 5), column=st.sampled_from(COLUMNS), junk=JUNK,
    separator=st.sampled_from([",", ";", "\t"]),
)  # fmt: skip
def test_any_cell_is_read_as_it_stands_or_refused_with_its_line(row, column, junk, separator):
    """What is accepted is what stands there; what the plate stated is accepted only unchanged."""
    text = filled({(row, column): junk}, separator=separator)
    blank = readings_of(filled(separator=separator), "sheet.csv")
    try:
        found = readings_of(text, "sheet.csv")
    except CaseError as error:
        found, words = None, str(error)
    if found is None:
        assert re.search(r"sheet\.csv(:\d+)?: ", words)
        return
    if column == "remarks" or not junk.strip() or column in DESIGNED:
        assert found == blank
        return
    number = float(junk.strip().replace(",", "."))
    if column in OF_BLOCKS:
        block = found.blocks[row]
        assert number in (*block.edges, block.mass, block.modulus, block.strength)
    else:
        assert found.struts[row - 2].width == number


@settings(max_examples=150)
@given(data=st.data())
def test_a_damaged_sheet_is_refused_or_read_whole(data):
    """Characters taken out, put in or changed: never a crash, never a value that is not there."""
    text = filled(MEASURED)
    place = data.draw(st.integers(0, len(text)))
    length = data.draw(st.integers(0, 8))
    text = text[:place] + data.draw(st.text(max_size=4)) + text[place + length :]
    try:
        found = readings_of(text, "sheet.csv")
    except CaseError:
        return
    assert (len(found.struts), len(found.blocks)) == (4, 2)
    values = set()
    for cell in re.split(r'[,;\t\s"]', text):
        with contextlib.suppress(ValueError):
            values.add(float(cell))
    for strut in found.struts:
        assert strut.width is None or strut.width in values


def measured_sheet():
    """A sheet whose struts and blocks are all measured, by round numbers."""
    rng = np.random.default_rng(2718)
    text = sheet_text(
        PlateFacts(process="m290-ti64", material="Ti-6Al-4V", cell="octet"),
        [
            PlacedBlock(
                block=Block(number=n, density=0.25, size=4.0, cells=3), volume=855.2,
                plates=422.28, as_built=None, ratio=1.1,
            )
            for n in (1, 2, 3)
        ],
        [
            Struts(number=number, inclination=angle, width=0.5, count=4)
            for number, angle in ((4, 0.0), (5, 90.0))
        ],
    )  # fmt: skip
    changes = {
        (3 + k, "width_mm"): f"{0.5 + d + rng.normal(0.0, 0.01):.4f}"
        for k, d in enumerate([0.1] * 4 + [0.03] * 4)
    }
    for row in range(3):
        changes |= {(row, "mass_g"): "3.9", (row, "modulus_MPa"): f"{9000 + 100 * row}"}
        changes |= {(row, "yield_MPa"): f"{50 + row}"}
    return filled(changes, {"gauge_mm": "0.002"}, text)


def test_a_filled_sheet_becomes_a_record_that_a_case_names(cli, tmp_path):
    """The commands as typed, from the sheet to the process and the material of a case."""
    (tmp_path / "sheet.csv").write_text(measured_sheet(), encoding="utf-8")
    ended = cli("coupon", "--read", tmp_path / "sheet.csv")
    assert ended.code == 0, ended.err
    assert "modulus over nominal" in ended.out
    assert '[process]\n  file = "m290-ti64.toml"' in ended.out
    data = json.loads(cli("coupon", "--read", tmp_path / "sheet.csv", "--json").out)
    (tmp_path / "case.toml").write_text(
        '[case]\nname = "block"\n[part]\nbox = ["8 mm", "8 mm", "8 mm"]\n'
        '[lattice]\ncell = "octet"\nsize = "4 mm"\ndensity = 0.25\n'
        '[process]\nfile = "m290-ti64.toml"\n[material]\nfile = "m290-ti64.toml"\n',
        encoding="utf-8",
    )
    registry = build_registry()
    case, part = fitting_part(load_case(tmp_path), registry)
    stated = stated_lattice(case, registry, part)
    process = stated.process.process
    assert process.name == "m290-ti64"
    sizes = [data[f"strut_size_{a}_deg_mm"]["value"] for a in (0, 90)]
    assert [size for _, size in process.strut_size] == pytest.approx(sizes, abs=5e-5)
    assert process.stiffness == pytest.approx(data["modulus_over_nominal"]["value"], rel=1e-3)
    assert process.scatter == pytest.approx(data["scatter_mm"]["value"], abs=5e-5)
    assert (process.samples, process.sizes) == (3, (0.5, 0.5))
    assert "coupons of 2026-11-27, process m290-ti64 on EOS M 290" in process.source
    assert stated.material.name == process.material == "Ti-6Al-4V"
    base, ratio = registry.materials["Ti-6Al-4V"], data["yield_over_nominal"]["value"]
    assert stated.material.yield_strength == pytest.approx(
        base.yield_strength * min(ratio, 1.0), rel=1e-4
    )
    assert stated.material.youngs_modulus == base.youngs_modulus


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "expected a cell, --process and -o for a plate, or --read for a sheet"),
        (("octet", "--read", "sheet.csv"), "leave them out"),
        (("--read", "sheet.csv"), "sheet.csv: cannot be read"),
        (("octet", "-o", "x"), "expected a cell, --process"),
    ],
)
def test_commands_without_what_they_need_are_refused(cli, words, said):
    ended = cli("coupon", *words)
    assert ended.code == 2
    assert said in " ".join(ended.err.split())


def test_a_record_ends_with_toml(cli, tmp_path):
    (tmp_path / "sheet.csv").write_text(measured_sheet(), encoding="utf-8")
    ended = cli("coupon", "--read", tmp_path / "sheet.csv", "-o", tmp_path / "record.py")
    assert ended.code == 2
    assert "expected a file that ends with .toml" in " ".join(ended.err.split())
    assert not (tmp_path / "record.py").exists()
