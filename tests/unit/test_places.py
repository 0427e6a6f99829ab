"""Every problem of a case has one place: file, line and key, wherever it is found."""

import re
from dataclasses import replace

import numpy as np
import pytest
from small_parts import WALLS, box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.case.schema import CaseFile
from gradedesign.design.check.check_case import check_case
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.program.host.registry import build_registry

PART = box_part(24, 12, 12, 6)
CASE = (
    held_bar(PART, force="0 N, 0 N, -4 N")
    + """\
[limits]
stress = "20 MPa"
[lattice]
cell = "walls"
size = "5 mm"
"""
)
FILE = 'file = "part.stl"\nunits = "mm"'


@pytest.fixture(scope="module")
def registry():
    known = build_registry(plugins=())
    law = power_law(
        "walls-law", ("walls",), youngs=(1.0, 2.0), strength=(1.0, 1.5), window=(0.1, 0.9),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )  # fmt: skip
    dense = power_law(
        "dense-law", ("walls",), youngs=(1.0, 2.0), strength=(1.0, 1.5), window=(0.992, 0.999),
        origin=LawOrigin(kind="computed", source="this test", test="none"),
    )  # fmt: skip
    return replace(
        known,
        cell_families={"walls": WALLS},
        scaling_laws={"walls-law": law, "dense-law": dense},
    )


@pytest.fixture
def box_file(tmp_path):
    """A box of 24 x 12 x 12 mm as STL."""
    from gradedesign.geometry.formats.write_stl import write_stl
    from gradedesign.geometry.part.box import box_surface

    write_stl(tmp_path / "part.stl", box_surface((24.0, 12.0, 12.0)))


#: Old text, new text, key of the problem, words of the line that it is placed at, words told.
MISTAKES = {
    "unit missing": (PART, 'file = "part.stl"', "part.units", "[part]", "carries no unit"),
    "unit of a stack": (
        f"{PART}\n[region.root]\nplane = \"x = min\"\n[region.tip]\nplane = \"x = max\"",
        'file = "part.stl"\nunits = "inch"\n[region.root]\nplane = "x = min"\n[region.tip]\n'
        'plane = "x = 24 mm"',
        "part.units", "units =", 'write units = "mm"?',
    ),
    "no region": ('"x = max"', '"x = 7 mm"', "region.tip", "[region.tip]", "no smooth face"),
    "material": ('"PA12"', '"PA99"', "material.name", "name = \"PA99\"", "no material named"),
    "law": ('size = "5 mm"', 'size = "5 mm"\nlaw = "no-law"', "lattice.law", "law =", "no-law"),
    "law without densities": (
        'size = "5 mm"', 'size = "5 mm"\nlaw = "dense-law"',
        "lattice.law", "law =", "dense-law 0.992 to 0.999",
    ),
    "warp that folds": (
        'size = "5 mm"',
        'size = "5 mm"\n[[lattice.warp]]\ncentre = ["12 mm", "6 mm", "6 mm"]\n'
        'stable_radius = "4 mm"\nouter_radius = "3 mm"\nmagnification = 1.5',
        "lattice.warp", "[[lattice.warp]]", "radius",
    ),
    "map about an axis": (
        'size = "5 mm"',
        'size = "5 mm"\n[lattice.cell_map]\nkind = "cylindrical"\naround = 12\n'
        'inner_radius = "40 mm"',
        "lattice.cell_map", "[lattice.cell_map]", "",
    ),
    "wall that fits no cell": (
        'size = "5 mm"', 'size = ["5 mm", "6 mm"]\ngrading = "size"\nwall = "5.9 mm"',
        "lattice.wall", "wall =", "walls of 5.9 mm",
    ),
    "own cell": (
        'cell = "walls"\nsize = "5 mm"',
        'cell = "mine"\nsize = "5 mm"\n[lattice.own_cell]\nmaker = "formula"\nformula = "x +"',
        "lattice.own_cell.formula", "formula =", "",
    ),
    "option of an own cell": (
        'cell = "walls"\nsize = "5 mm"',
        'cell = "mine"\nsize = "5 mm"\n[lattice.own_cell]\nmaker = "formula"\nformular = "x"',
        "lattice.own_cell.formular", "formular =", "no such option",
    ),
    "zone": (
        'size = "5 mm"',
        'size = "5 mm"\n[[zone]]\nregion = "tip"\nwithin = "6 mm"\ncell = "wals"',
        "zone[0].cell", "cell = \"wals\"", "no cell family",
    ),
    "densities of a zone": (
        'size = "5 mm"',
        'size = "5 mm"\n[[zone]]\nregion = "tip"\nwithin = "6 mm"\ndensity = [0.995, 0.999]',
        "zone[0].density", "density = [0.995", "nothing in common",
    ),
    "memory": (
        'size = "5 mm"', 'size = "5 mm"\nskin = "0.1 mm"\n[run]\nmemory = "0.5 GB"',
        "run.memory", "memory =", "does not fit",
    ),
}  # fmt: skip


def checked(folder, registry):
    case = load_case(folder)
    return check_case(case, with_own_cell(case.lattice, registry, case.where))


@pytest.mark.parametrize(("old", "new", "key", "at", "words"), MISTAKES.values(), ids=MISTAKES)
def test_one_place(old, new, key, at, words, box_file, registry, tmp_path):
    assert CASE.count(old) == 1
    text = CASE.replace(old, new)
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(GradeDesignError) as caught:
        checked(tmp_path, registry)
    assert caught.value.exit_code in (2, 3, 5), caught.type
    first, *others = str(caught.value).split("\n")
    message = others[0] if "in the case file" in first else first
    line = next(n for n, row in enumerate(text.split("\n"), start=1) if row.startswith(at))
    assert message.startswith(f"case.toml:{line}: {key}: "), message
    assert message.count("case.toml") == 1
    assert len(re.findall(r"\b" + re.escape(key) + r": ", message)) == 1
    assert words in message


def test_a_key_is_told_from_a_file():
    from gradedesign.common.values.problems import is_key

    assert is_key(CaseFile, "part.units")
    assert is_key(CaseFile, "load_case[0].fix[1].region")
    assert not is_key(CaseFile, "part.stl")
    assert not is_key(CaseFile, "lattice.stl")
    assert not is_key(CaseFile, "bracket.units")


def test_an_unwritten_key_has_the_line_of_its_table(tmp_path):
    (tmp_path / "case.toml").write_text(CASE)
    case = load_case(tmp_path)
    row = CASE.split("\n").index("[lattice]") + 1
    assert case.where("lattice.density") == f"case.toml:{row}: lattice.density"
    assert case.where("run.memory") == "case.toml: run.memory"


@pytest.mark.parametrize(("units", "size"), [("inch", 25.4), ("m", 1000.0), ("micron", 1e-3)])
def test_a_wrong_unit_is_asked_for_before_a_region(units, size, box_file, registry, tmp_path):
    text = CASE.replace(PART, FILE.replace('"mm"', f'"{units}"'))
    (tmp_path / "case.toml").write_text(text.replace('"x = max"', '"x = 24 mm"'))
    with pytest.raises(CaseError) as caught:
        check_case(load_case(tmp_path), registry)
    asked = f'part.units: found "{units}", in which the part is {24 * size:.4g} x'
    assert asked in str(caught.value)
    assert 'in "mm" it is 24 x 12 x 12 mm and every region is found: write units = "mm"?' in str(
        caught.value
    )
    # No unit makes this one right: the faces are told, not a unit.
    (tmp_path / "case.toml").write_text(text.replace('"x = max"', '"x = 7.7 mm"'))
    with pytest.raises(CaseError, match=r"region\.tip: no smooth face") as caught:
        check_case(load_case(tmp_path), registry)
    assert "part.units" not in str(caught.value)


def test_microns_are_a_unit(box_file, registry, tmp_path):
    (tmp_path / "case.toml").write_text(CASE.replace(PART, FILE.replace('"mm"', '"um"')))
    case = load_case(tmp_path)
    from gradedesign.design.resolve.fitting_part import part_of
    from gradedesign.design.resolve.part_readers import part_readers

    part = part_of(case, part_readers(case.part, case.run.memory, registry))
    assert np.ptp(part.surface.vertices, axis=0) == pytest.approx([0.024, 0.012, 0.012])
