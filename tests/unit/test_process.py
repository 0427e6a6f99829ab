"""Printing processes: records, their relation of struts to surfaces, and the table of a case."""

import json

import numpy as np
import pytest

from gradedesign.design.printing.process import Process, surface_offset
from gradedesign.design.printing.process_schema import builtin_processes

SHIPPED = {process.name: process for process in builtin_processes()}

CASE = """\
[case]
name = "printed"
[part]
box = ["10 mm", "5 mm", "5 mm"]
[material]
name = "{material}"
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.4
[print]
build_direction = "+x"
[process]
{keys}
"""


def mean_width_change(process, inclination):
    """Twice the mean offset round a strut, by the midpoint rule."""
    around = (np.arange(20_000) + 0.5) * 2 * np.pi / 20_000
    vertical = np.cos(np.radians(inclination)) * np.sin(around)
    return 2.0 * surface_offset(process, vertical).mean()


@pytest.mark.parametrize("name", [n for n, p in SHIPPED.items() if p.strut_size])
def test_struts_of_every_inclination_grow_by_their_table(name):
    process = SHIPPED[name]
    for angle, size in process.strut_size:
        # The rule is exact to about (1e-4)^1.5 of the slope at kinks of the offset.
        assert mean_width_change(process, angle) == pytest.approx(size, abs=1e-6)
        assert process.strut_size_at(angle) == pytest.approx(size, abs=1e-12)
    assert mean_width_change(process, 30.0) == pytest.approx(process.strut_size_at(30.0), abs=1e-6)


def test_a_size_that_is_linear_in_the_cosine_has_the_offset_of_the_integral_equation():
    # By hand: D = a + b c gives d(s) = (a + b s pi / 2) / 2.
    process = Process(name="p", strut_size=((0.0, 0.11), (90.0, 0.01)))
    s = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    expected = 0.5 * (0.01 + 0.1 * np.abs(s) * np.pi / 2)
    assert surface_offset(process, s) == pytest.approx(expected, abs=1e-12)


def test_a_table_of_offsets_tells_up_from_down():
    process = Process(name="p", offset=((0.0, 0.2), (90.0, 0.05), (180.0, -0.01)))
    down, wall, up = surface_offset(process, np.array([-1.0, 0.0, 1.0]))
    assert (down, wall, up) == pytest.approx((0.2, 0.05, -0.01))
    assert process.strut_size_at(90.0) == pytest.approx(0.1)
    assert process.strut_size_at(0.0) == pytest.approx(mean_width_change(process, 0.0), abs=1e-6)


def test_published_numbers_stand_as_read():
    # npj Advanced Manufacturing 2025, s44334-025-00019-y, table 2: measured less designed.
    octet = SHIPPED["lpbf-ti64-struts"]
    measured = (1286, 1240, 919, 362, 236)
    designed = (1250, 1208, 839, 324, 200)
    assert [size for _, size in octet.strut_size] == pytest.approx(
        [(m - d) * 1e-3 for m, d in zip(measured, designed, strict=True)]
    )
    assert octet.scatter == pytest.approx(np.mean([58, 41, 37, 34, 48]) * 1e-3, abs=5e-4)
    # Materials 2022, 15, 4729, conclusions.
    assert SHIPPED["lpbf-ti64-diamond"].strut_size == ((0.0, 0.1054), (90.0, 0.0075))
    assert SHIPPED["lpbf-ti64-gyroid"].strut_size == ((0.0, 0.1986), (90.0, 0.0126))
    # Int. J. Bioprinting 9(4), table 4, ligaments of the design and by SEM.
    design = (0.73, 1.01, 1.27, 1.52, 1.82, 1.43, 1.71, 1.96, 2.20, 2.47)
    printed = (0.61, 0.86, 1.15, 1.48, 1.74, 1.30, 1.57, 1.87, 2.04, 2.31)
    change = np.median(np.subtract(printed, design))
    assert SHIPPED["lpbf-ti21s-gyroid"].strut_size[0][1] == pytest.approx(change)
    assert not SHIPPED["sls-pa12-struts"].has_body
    for process in SHIPPED.values():
        assert "Read" in process.source
        assert process.material


def test_processes_are_listed(cli):
    data = json.loads(cli("processes", "--json").out)
    assert {entry["name"] for entry in data} >= set(SHIPPED)
    (octet,) = (entry for entry in data if entry["name"] == "lpbf-ti64-struts")
    assert octet["strut_size_mm"]["45"] == pytest.approx(0.08)
    table = cli("processes").out
    assert all(entry["name"] in table for entry in data)
    assert "+36, +80, +36" in table


def generated(cli, folder, keys, code=0, material="Ti-6Al-4V"):
    (folder / "case.toml").write_text(CASE.format(keys=keys, material=material), encoding="utf-8")
    ended = cli("run", folder, "-o", folder / "out", "--overwrite")
    assert ended.code == code, ended.err
    path = folder / "out" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8")) if code == 0 else {}
    return result, " ".join((ended.out + ended.err).split())


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('name = "lpbf-ti64-octt"', "case.toml:14: process.name: no printing process named"),
        ('name = "lpbf-ti64-struts"\nscatter = "0.1 mm"', "process.scatter: found beside name"),
        ('scatter = "0.1 mm"', "found neither name nor what makes a body another one"),
        ('offset = ["0 deg"]', "process.offset: entry 1: found"),
        ('offset = [["9 deg", "0 mm"], ["9 deg", "1 mm"]]', "expected rising angles"),
        ('offset = [["0 deg", "1 m"]]', "at most 10 mm"),
        ('strut_size = [["100 deg", "0 mm"]]', "at most 90 deg"),
        ('strut_size = [["0 deg", "0 mm"]]\noffset = [["0 deg", "0 mm"]]', "found beside strut_s"),
        ('name = "lpbf-ti64-struts"\nspread = "1 mm"', 'did you mean "scatter"'),
        ('offset = [["0 deg", "0 mm"]]\nvariants = 3', "case.toml:15: process.variants: found 3"),
        ('name = "sls-pa12-struts"\ncompensate = true', "case.toml:15: process.compensate"),
        ('offset = [["0 deg", "0 mm"]]\nsizes = ["2 mm", "1 mm"]', "smaller one first"),
        ("stiffness_along = 0.9", "stiffness_along: goes with stiffness, such as stiffness = 0.9"),
        ("stiffness = 1.0\nshear_along = 0.9", "shear_along: goes with stiffness_along, such as"),
        (
            'name = "sls-pa12-struts"\n[limits]\njudged = "as_built"',
            'case.toml:16: limits.judged: found "as_built", but of process sls-pa12-struts',
        ),
    ],
)
def test_wrong_keys_are_refused_with_what_is_expected(cli, tmp_path, keys, words):
    _, told = generated(cli, tmp_path, keys, 2)
    assert words in told


def test_judged_needs_a_process(cli, tmp_path):
    text = CASE.format(keys="", material="PA12").replace("[process]\n", '[limits]\njudged = "both"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path)
    assert ended.code == 2
    assert 'case.toml:14: limits.judged: found "both" without [process]' in ended.err


def test_the_lattice_of_a_stated_density_has_its_as_built_mass(cli, tmp_path):
    keys = 'offset = [["0 deg", "0.02 mm"]]\nsizes = ["0.1 mm", "0.2 mm"]\nmaterial = "316L"'
    result, told = generated(cli, tmp_path, keys)
    built = result["measures"]["as_built"]
    # A uniform offset: area of the surface times it, within the curvature (0.02 mm over 1 mm).
    assert built["as_built_mm3"] > built["nominal_mm3"] * 1.01
    assert built["as_built_g"] / built["nominal_g"] == pytest.approx(
        built["as_built_mm3"] / built["nominal_mm3"]
    )
    assert built["strut_size_mm"]["45"] == pytest.approx(0.04)
    assert f"as built by stated: {built['as_built_g']:.4g} g" in told
    assert "was measured on 316L, the material of the case is Ti-6Al-4V" in told
    assert "was measured on widths of 0.1 to 0.2 mm" in told
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<h2>As built</h2>" in page


def test_a_process_without_data_says_so_and_invents_nothing(cli, tmp_path):
    result, told = generated(cli, tmp_path, 'name = "sls-pa12-struts"', material="PA12")
    assert "as_built_mm3" not in result["measures"]["as_built"]
    assert "neither offset, waviness nor stiffness" in told


def test_a_compensated_file_is_written_under_a_name_that_says_so(cli, tmp_path):
    result, _ = generated(cli, tmp_path, 'offset = [["0 deg", "0.05 mm"]]\ncompensate = true')
    assert result["files"]["compensated"] == "lattice_compensated.stl"
    assert (tmp_path / "out" / "lattice_compensated.stl").stat().st_size > 84
    built = result["measures"]["as_built"]
    assert built["compensated"]["file_mm3"] < built["nominal_mm3"]
    # The as-built body is that of the compensated file: the designed one, but for its acute rims,
    # where sheets of 1.6 mm end on the box: 0.05 mm on either side of 2 % of the volume or so.
    assert built["as_built_mm3"] == pytest.approx(built["nominal_mm3"], rel=1e-2)
    assert built["compensated"]["rms_mm"] < 0.01
