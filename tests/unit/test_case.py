"""A case file becomes a checked record in internal units, with the line of every key."""

import json
import logging
import re
import tomllib
from pathlib import Path

import pytest
from pydantic import ValidationError

from gradedesign.common.values.toml_lines import key_lines, line_of
from gradedesign.design.case.read_case import load_case
from gradedesign.design.case.schema import CaseFile, Exclusion, schema_json

#: The example of design.md, section 5, without the bolts (a box has none).
CASE = """\
[case]
name = "cantilever"

[part]
box = ["1500 mm", "300 mm", "20 cm"]
mesh_size = "12 mm"

[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"

[material]
name = "Ti-6Al-4V"

[[keep]]
region = "root"
margin = "3 mm"

[[load_case]]
name = "tip load"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-5 kN"]}]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
temperature_change = "0 K"

[limits]
stress = "50 MPa"
percentile = 99.5
exclusion_radius = "2 mesh sizes"
displacement = [{region = "tip", magnitude = "2 mm"}]

[lattice]
cell = "gyroid-sheet"
size = "50 mm"
grading = "level"
density = [0.10, 0.65]
law = "auto"
skin = {thickness = "2 mm"}

[print]
min_wall = "0.8 mm"

[run]
memory = "8 GB"
time = "20 min"
acceptance = "auto"
max_iterations = 6
stop_after = "verdict"

[output]
formats = ["stl", "vtu", "report"]
"""

OWN_MATERIAL = """\
[material]
youngs_modulus = "200 GPa"
poissons_ratio = 0.3
density = "7850 kg/m^3"
yield_strength = "250 MPa"
thermal_expansion = "12 um/m/K"
"""


@pytest.fixture
def load(tmp_path):
    def _load(text=CASE, **changes):
        for old, new in changes.get("swap", []):
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "case.toml"
        path.write_text(text)
        return load_case(path)

    return _load


def test_design_example_is_read_in_internal_units(load, tmp_path):
    case = load()
    assert case.name == "cantilever"
    assert case.path == tmp_path / "case.toml"
    assert case.folder == tmp_path
    assert case.part.box == (1500.0, 300.0, 200.0)
    assert case.part.file is None
    assert case.part.mesh_size == 12.0
    assert (case.part.repair, case.part.bodies) == ("safe", "one")
    assert case.material.name == "Ti-6Al-4V"
    assert [(k.region, k.margin) for k in case.keep] == [("root", 3.0)]
    (loading,) = case.load_case
    assert loading.fix[0].displacement == (0.0, 0.0, 0.0)
    assert loading.load[0].force == (0.0, 0.0, -5000.0)
    assert loading.load[0].pressure is None
    assert loading.acceleration == (0.0, 0.0, -9810.0)
    assert loading.temperature_change == 0.0
    assert case.limits.stress == 50.0
    assert case.limits.exclusion_mesh_sizes == 2.0
    assert case.limits.exclusion_radius is None
    limit = case.limits.displacement[0]
    assert (limit.region, limit.magnitude, limit.component) == ("tip", 2.0, None)
    assert case.lattice.density == (0.10, 0.65)
    assert case.lattice.skin[0].thickness == (2.0, 2.0)
    assert case.print.min_wall == 0.8
    assert case.run.memory == 8_000_000_000
    assert case.run.time == 1200.0
    assert case.output.formats == ("stl", "vtu", "report")
    assert case.warnings == ()


def test_defaults_of_optional_tables(load):
    text = CASE[: CASE.index("[print]")].replace('exclusion_radius = "2 mesh sizes"\n', "")
    for line in ('grading = "level"\n', 'law = "auto"\n', 'skin = {thickness = "2 mm"}\n'):
        text = text.replace(line, "")
    case = load(text)
    assert case.print is None
    assert (case.run.memory, case.run.time) == (8_000_000_000, 3600.0)
    assert (case.run.acceptance, case.run.max_iterations, case.run.stop_after) == (
        "auto",
        12,
        "verdict",
    )
    assert (case.run.elements_per_wall, case.run.submodel_count) == (None, 2)
    assert case.run.explicit_mesh_size is None
    assert case.output.formats == ("stl", "vtu", "report")
    assert case.limits.exclusion == Exclusion()
    assert (case.lattice.grading, case.lattice.law, case.lattice.skin) == ("level", "auto", ())
    assert case.lattice.filter_radius == 1.0
    assert case.lattice.origin == (0.0, 0.0, 0.0)
    assert case.lattice.rotation == (0.0, 0.0, 0.0)
    assert case.lattice.parameters == {}


def test_what_finite_cells_take_by_default_can_be_stated(load):
    case = load(swap=[("[run]\n", "[run]\nelements_per_wall = 0.7\n")])
    assert case.run.elements_per_wall == 0.7


def test_own_material(load):
    case = load(swap=[('[material]\nname = "Ti-6Al-4V"\n', OWN_MATERIAL)])
    material = case.material
    assert material.name is None
    assert material.youngs_modulus == 200e3
    assert material.density == pytest.approx(7.85e-9)
    assert material.yield_strength == 250.0
    assert material.thermal_expansion == pytest.approx(12e-6)


def test_every_form_of_support_and_load(load):
    case = load(
        swap=[
            (
                'fix = [{region = "root"}]',
                'fix = [{region = "root", components = "xy"},\n'
                '       {region = "root", displacement = ["0 mm", "free", "0.1 mm"]}]',
            ),
            (
                'load = [{region = "tip", force = ["0 N", "0 N", "-5 kN"]}]',
                'load = [{region = "tip", pressure = "2 MPa"},\n'
                '  {region = "tip", moment = ["0 N*m", "1 N*m", "0 N*m"]}]',
            ),
        ]
    )
    fixes, loads = case.load_case[0].fix, case.load_case[0].load
    assert [f.displacement for f in fixes] == [(0.0, 0.0, None), (0.0, None, 0.1)]
    assert loads[0].pressure == 2.0
    assert loads[1].moment == (0.0, 1000.0, 0.0)
    # fix stands on row 22, its second entry on 23; load on 24, its second entry on 25
    assert case.where("load_case[0].fix[1]") == "case.toml:23: load_case[0].fix[1]"
    assert case.where("load_case[0].load[1].moment").startswith("case.toml:25:")
    assert case.where("run.nothing") == "case.toml:46: run.nothing"


REGIONS = """
[region.plane_at]
plane = "z = -12.5 mm"
[region.plane_tilted]
plane = {point = ["0 mm", "0 mm", "1 cm"], normal = [0, 3, 4]}
[region.bolts]
cylinder = {diameter = "8 mm", axis = "z", point = ["1 mm", "2 mm", "0 mm"]}
count = 4
[region.top]
facing = "-y"
angle = "20 deg"
nearest = ["50 mm", "0 mm", "10 mm"]
[region.cut]
box = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["1 mm", "1 mm", "1 mm"]}
clip = true
area = "600 mm^2"
[region.both]
any = ["root", "tip"]
all = "cut"
not = "bolts"
inside = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["1 mm", "1 mm", "1 mm"]}
"""


def test_every_form_of_region(load):
    region = load(CASE + REGIONS).region
    assert (region["root"].plane.axis, region["root"].plane.position) == (0, "min")
    assert (region["plane_at"].plane.axis, region["plane_at"].plane.position) == (2, -12.5)
    tilted = region["plane_tilted"].plane
    assert tilted.point == (0.0, 0.0, 10.0)
    assert tilted.normal == pytest.approx((0.0, 0.6, 0.8))
    assert tilted.axis is None
    cylinder = region["bolts"].cylinder
    assert (cylinder.diameter, cylinder.axis, cylinder.point) == ((8.0, 8.0), "z", (1.0, 2.0, 0.0))
    assert region["bolts"].count == 4
    assert region["top"].facing_vector == (0.0, -1.0, 0.0)
    assert (region["top"].angle, region["bolts"].angle) == (20.0, 15.0)
    assert region["top"].nearest == (50.0, 0.0, 10.0)
    assert region["cut"].box.upper == (1.0, 1.0, 1.0)
    assert region["cut"].clip is True
    assert region["cut"].area == 600.0
    both = region["both"]
    assert (both.any, both.all, both.not_) == (("root", "tip"), ("cut",), ("bolts",))
    assert both.names == ("root", "tip", "cut", "bolts")
    assert both.inside.lower == (0.0, 0.0, 0.0)


def test_component_limit_and_length_exclusion(load):
    case = load(
        swap=[
            ('magnitude = "2 mm"}', 'component = "z", magnitude = "2 mm", load_case = "tip load"}'),
            ('"2 mesh sizes"', '"5 mm"'),
        ]
    )
    limit = case.limits.displacement[0]
    assert (limit.component, limit.magnitude, limit.load_case) == (2, 2.0, "tip load")
    assert (case.limits.exclusion_radius, case.limits.exclusion_mesh_sizes) == (5.0, None)


def test_records_are_frozen(load):
    case = load()
    with pytest.raises(ValidationError, match="frozen"):
        case.lattice.size = 3.0
    changed = case.model_copy(update={"name": "other"})
    assert (changed.name, case.name) == ("other", "cantilever")


def test_hash_follows_meaning_not_spelling(load):
    base = load().case_hash
    assert len(base) == 64
    assert load("# a remark\n" + CASE).case_hash == base
    assert load(swap=[('"-5 kN"', '"-5000 N"')]).case_hash == base
    assert load(swap=[('"-5 kN"', '"-5001 N"')]).case_hash != base
    assert load(swap=[('[output]\nformats = ["stl", "vtu", "report"]\n', "")]).case_hash == base


def test_a_case_with_more_time_or_memory_or_other_files_is_the_same_case(load):
    # so that a run that ran out of either resumes
    base = load().case_hash
    for less, more in (
        ('time = "20 min"', 'time = "40 min"'),
        ('memory = "8 GB"', 'memory = "16 GB"'),
        ("max_iterations = 6", "max_iterations = 9"),
        ("max_iterations = 6", "max_iterations = 6\nprice = false"),
        # or that an exporter stopped: its iterations are worth keeping
        ('["stl", "vtu", "report"]', '["vtu", "ply"]'),
    ):
        assert load(swap=[(less, more)]).case_hash == base
    assert load(swap=[('acceptance = "auto"', 'acceptance = "whole"')]).case_hash != base


def with_file(folder, *, content=b"solid"):
    (folder / "part.stl").write_bytes(content)
    box = 'box = ["1500 mm", "300 mm", "20 cm"]'
    (folder / "case.toml").write_text(CASE.replace(box, 'file = "part.stl"\nunits = "inch"'))
    return folder / "case.toml"


def test_hash_follows_part_bytes_not_place(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    case = load_case(with_file(one))
    assert case.part.file == one / "part.stl"
    assert case.part.units == "inch"
    assert load_case(with_file(two)).case_hash == case.case_hash
    assert load_case(with_file(two, content=b"Solid")).case_hash != case.case_hash


def test_folder_and_relative_path_are_accepted(tmp_path, monkeypatch):
    with_file(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert load_case(tmp_path).name == "cantilever"
    case = load_case(Path("case.toml"))
    assert case.path == tmp_path / "case.toml"


def test_windows_line_ends_and_mark_are_accepted(tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes(b"\xef\xbb\xbf" + CASE.replace("\n", "\r\n").encode())
    case = load_case(path)
    assert case.where("limits.stress") == "case.toml:28: limits.stress"


WARNED = [
    ([("0.3", "0.495")], "nearly incompressible"),
    (
        [('"200 GPa"', '"200 Pa"')],
        "youngs_modulus: found 2e-07 GPa; solids lie between 0.0005",
    ),
    (
        [('"200 GPa"', '"2000 GPa"')],
        "youngs_modulus: found 2000 GPa; solids lie between 0.0005",
    ),
    (
        [('"7850 kg/m^3"', '"7850 g/cm^3"')],
        "density: found 7850 g/cm^3; solids lie between",
    ),
    ([('"7850 kg/m^3"', '"7.85 kg/m^3"')], "material.density: found 0.00785 g/cm^3"),
    (
        [('"12 um/m/K"', '"0.9 mm/m/K"')],
        "thermal_expansion: found 900 um/m/K; solids lie",
    ),
    ([('"12 um/m/K"', '"-12 um/m/K"')], "material.thermal_expansion: found -12 um/m/K"),
    (
        [("0.3", "-0.3")],
        "poissons_ratio: found -0.3; solids lie between 0 and",
    ),
    # 250 MPa is a twentieth of 5 GPa.
    ([('"200 GPa"', '"4.9 GPa"')], "material.yield_strength: found 250 MPa, more than a twentieth"),
    ([('load = [{region = "tip"', 'load = [{region = "root"')], "that load does nothing"),
    ([('magnitude = "2 mm"', 'magnitude = "2e-4 mm"')], "allows 0.0002 mm, less than a micrometre"),
]


@pytest.mark.parametrize(("swap", "words"), WARNED, ids=[w for _, w in WARNED])
def test_doubtful_values_are_warned_of(load, caplog, swap, words):
    text = CASE.replace('[material]\nname = "Ti-6Al-4V"\n', OWN_MATERIAL)
    with caplog.at_level(logging.WARNING):
        case = load(text, swap=swap)
    assert any(words in w for w in case.warnings)
    assert all(re.match(r"case\.toml:\d+: [a-z_.0-9\[\]]+: ", w) for w in case.warnings)
    assert words in caplog.text


def test_lines_of_tricky_toml():
    text = (
        '# c = 1\n"a b".c = """x\n[no]\n"""""\n[[t]] # first\n'
        "x = {y = [1,\n {z = '['}], w = \"}\"}\n"
        "[[t]]\n[t.u]\nv.w = 1979-05-27 07:32:00\n[t.u.'k.k']\nq = 5 # end\n"
    )
    parsed = tomllib.loads(text)
    assert parsed["t"][1]["u"]["k.k"]["q"] == 5  # the text is valid and means what we think
    lines = key_lines(text)
    # counted by eye in the text above
    expected = {
        ("a b", "c"): 2,
        ("t", 0): 5,
        ("t", 0, "x"): 6,
        ("t", 0, "x", "y", 1, "z"): 7,
        ("t", 0, "x", "w"): 7,
        ("t", 1): 8,
        ("t", 1, "u"): 9,
        ("t", 1, "u", "v", "w"): 10,
        ("t", 1, "u", "k.k", "q"): 12,
    }
    assert {key: lines.get(key) for key in expected} == expected
    assert line_of(lines, ("t", 1, "u", "missing")) == 9
    assert line_of(lines, ("nowhere",)) == 1


def test_lines_name_every_key_that_toml_holds():
    def keys(value, path=()):
        if path:
            yield path
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in pairs:
            if isinstance(inner, dict | list):
                yield from keys(inner, (*path, key))
            else:
                yield (*path, key)

    text = CASE + REGIONS
    assert set(keys(tomllib.loads(text))) <= set(key_lines(text))


def test_json_schema_for_editors():
    schema = schema_json(CaseFile)
    json.dumps(schema)
    assert schema["required"] == ["case", "part", "lattice"]
    assert schema["else"]["required"] == ["material", "load_case", "limits"]
    definitions = schema["definitions"]
    gradings = definitions["LatticeSpec"]["properties"]["grading"]["enum"]
    assert gradings == ["uniform", "level", "thickness", "size", "ratio"]
    assert "not" in definitions["RegionSpec"]["properties"]
    assert "displacement" in definitions["FixSpec"]["properties"]
    assert definitions["PartSpec"]["additionalProperties"] is False
    kinds = {each["type"] for each in definitions["PartSpec"]["properties"]["mesh_size"]["anyOf"]}
    assert kinds == {"string", "null"}
