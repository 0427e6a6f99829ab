"""Records of what was measured, which a case names by file: data of a process, of a material."""

from __future__ import annotations

import pytest

from gradedesign import CaseError, load_case
from gradedesign.commands import build_registry
from gradedesign.design.resolve.resolve import case_process, resolve_material

CASE = """\
[case]
name = "block"
[part]
box = ["10 mm", "10 mm", "10 mm"]
[lattice]
cell = "bcc"
size = "5 mm"
density = 0.3
[material]
{material}
[process]
{process}
"""
PROCESS = """\
strut_size = [["0 deg", "0.1 mm"], ["90 deg", "0.02 mm"]]
scatter = "0.016 mm"
stiffness = 0.83
material = "Ti-6Al-4V"
machine = "EOS M 290"
samples = 6
source = "coupons of 2026-11-27"
"""
MATERIAL = """\
youngs_modulus = "110 GPa"
poissons_ratio = 0.34
density = "4.41 g/cm^3"
yield_strength = "745 MPa"
"""
FILE = 'file = "m290.toml"'
RECORD = f"""\
[process]
{PROCESS}
[material]
name = "Ti-6Al-4V"
source = "yield of coupons"
{MATERIAL}
[fitted]
confidence = 0.95
"""


@pytest.fixture
def read(tmp_path):
    """Read a case with these tables, beside a record with this text."""

    def case(record=RECORD, process=FILE, material=FILE):
        (tmp_path / "m290.toml").write_text(record, encoding="utf-8")
        text = CASE.format(process=process, material=material)
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        return load_case(tmp_path)

    return case


def test_a_case_that_names_a_record_has_what_it_states(read):
    case, registry = read(), build_registry()
    material = resolve_material(case.material, registry)
    assert (material.name, material.source) == ("Ti-6Al-4V", "yield of coupons")
    assert (material.yield_strength, material.youngs_modulus) == (745.0, 110e3)
    found = case_process(case.process, None, None, registry, case.where)
    process = found.process
    assert process.name == "m290"
    assert process.strut_size == ((0.0, 0.1), (90.0, 0.02))
    assert (process.scatter, process.stiffness, process.samples) == (0.016, 0.83, 6)
    assert process.source == "coupons of 2026-11-27"
    assert found.judged == "both"


def test_what_counts_is_the_content_of_the_record(read):
    """A case is the same whether it states the figures or names a record of them."""
    stated = read(process=PROCESS, material=MATERIAL).case_hash
    assert read().case_hash == stated
    assert read(record="# kept\n" + RECORD).case_hash == stated
    assert read(record=RECORD.replace("0.83", "0.84")).case_hash != stated
    assert read(record=RECORD.replace("745", "744")).case_hash != stated


def test_beside_a_record_stands_what_is_asked_of_the_process(read):
    case = read(process=FILE + "\nvariants = 3\ncompensate = true")
    assert (case.process.variants, case.process.compensate) == (3, True)


def test_a_record_may_hold_the_stiffness_alone(read):
    only = '[process]\nstiffness = 0.9\n[material]\nname = "x"\n' + MATERIAL
    case = read(record=only)
    found = case_process(case.process, None, None, build_registry(), case.where)
    assert found.process.has_body
    assert not found.process.strut_size


@pytest.mark.parametrize(
    ("record", "process", "material", "words"),
    [
        (RECORD, FILE + '\nname = "x"', FILE, "file: found beside name"),
        (RECORD, FILE + '\nscatter = "1 um"', FILE, "scatter: found beside file, which states it"),
        (RECORD, FILE, FILE + "\npoissons_ratio = 0.3", "poissons_ratio: found beside file"),
        (RECORD, FILE, FILE + '\nname = "PA12"', "name: found beside file"),
        (RECORD, 'file = "m29.toml"', FILE, 'does not exist; did you mean "m290.toml"'),
        (RECORD, 'file = "../m290.toml"', FILE, "process.file: found"),
        (RECORD, 'file = "m290.py"', FILE, "readable: .toml"),
        (RECORD, "file = 3", FILE, "process.file: found 3"),
        ("x = [", FILE, FILE, "process.file: m290.toml: not a record in TOML"),
        ("", FILE, FILE, "m290.toml: has no table [process]"),
        ("process = 3", FILE, FILE, "m290.toml: has no table [process]"),
        (RECORD + "[run]\n", FILE, FILE, "found 'run'; available: process, material, fitted"),
        (
            RECORD.replace("scatter", "scater"), FILE, FILE,
            'm290.toml: process.scater: unknown key; did you mean "scatter"',
        ),
        (
            RECORD.replace('"0.016 mm"', "0.016"), FILE, FILE,
            "m290.toml: process.scatter: found 0.016",
        ),
        (RECORD.replace('"110 GPa"', '"-1 GPa"'), FILE, FILE, "m290.toml: material.youngs_modulus"),
        (RECORD.replace("poissons_ratio = 0.34\n", ""), FILE, FILE, "m290.toml: material"),
        (
            RECORD.replace("stiffness", 'file = "y.toml"\nstiffness'), FILE, FILE,
            "a record names no other record",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_record_is_told_with_its_key(read, record, process, material, words):
    with pytest.raises(CaseError) as error:
        read(record, process, material)
    assert words in str(error.value)
    assert "case.toml:" in str(error.value)


def test_a_record_that_is_no_text_or_too_large_is_refused(read, tmp_path):
    read()
    for content, words in (
        (b"\xff\xfe", "not a record in TOML"),
        (b"#" * 1_000_001, "more than 1000000 bytes"),
    ):
        (tmp_path / "m290.toml").write_bytes(content)
        with pytest.raises(CaseError, match=words):
            load_case(tmp_path)
