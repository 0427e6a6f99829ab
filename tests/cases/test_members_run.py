"""Solid members from the case to the printed file."""

import json

import meshio
import numpy as np
import pytest
from small_parts import SHEARED_BAR

from gradedesign.common.system.progress import ignore
from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.mechanics.limits.member_stress import BodyStressLimit
from gradedesign.pipeline import _solved
from gradedesign.program.host.registry import build_registry
from gradedesign.program.store.run_folder import open_run_folder

CASE = (
    SHEARED_BAR.replace('"4 mm"', '"1.7 mm"')
    + """\
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.3, 0.7]
size_effects = false
PHASES
[run]
price = false
RUN
[output]
formats = ["stl"]
"""
)
MEMBERS = 'phases = ["lattice", "solid"]\nleast_member = "2.6 mm"'


def ran(folder, cli, phases, run):
    folder.mkdir()
    text = CASE.replace("PHASES", phases).replace("RUN", run)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", folder, "-o", folder / "r")
    result = json.loads((folder / "r" / "result.json").read_text(encoding="utf-8"))
    return result, ended


def test_members_save_mass_and_are_in_the_printed_file(tmp_path, cli):
    stop = 'stop_after = "lattice"'
    members, ended = ran(tmp_path / "members", cli, MEMBERS, stop)
    assert ended.code == 0, ended.out + ended.err
    alone, _ = ran(tmp_path / "alone", cli, 'phases = ["lattice"]', stop)
    assert members["mass_g"] < 0.95 * alone["mass_g"]
    (found,) = members["measures"]["solid_members"]
    assert found["count"] >= 1
    assert found["least_thickness_mm"] == 2.6
    assert "solid_members" not in alone["measures"]
    surface = meshio.read(tmp_path / "members" / "r" / "lattice.stl")
    a, b, c = surface.points[surface.cells_dict["triangle"]].swapaxes(0, 1)
    volume = float((a * np.cross(b, c)).sum() / 6.0)
    # Ti-6Al-4V, 4.41e-3 g/mm^3; the mass of the homogenised part is right within a tenth.
    assert volume * 4.41e-3 == pytest.approx(members["mass_g"], rel=0.1)


def without_cells(text):
    """The case with members alone, as thick as before."""
    before, _, after = text.partition('cell = "gyroid-sheet"')
    _, _, after = after.partition("PHASES")
    return f'{before}phases = ["solid", "void"]\nleast_member = "2.6 mm"{after}'


def test_what_a_case_leaves_open_holds_in_its_run(tmp_path):
    """Submodels are cut around cells: without any the whole surface is meshed again, unasked."""
    text = without_cells(CASE).replace("RUN", 'time = "17 min"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    case = load_case(tmp_path)
    registry = with_own_cell(case.lattice, build_registry(), case.where)
    folder = open_run_folder(tmp_path / "r", case.case_hash, resume=False, overwrite=False)
    with folder as out:
        run = _solved(case, registry, out, Announcer(ignore)).plan.case.run
    assert (case.run.acceptance, run.acceptance) == ("auto", "whole")
    assert (run.memory, run.time) == (case.run.memory, 17 * 60.0)


def test_members_without_cells_are_the_whole_body(tmp_path, cli, monkeypatch):
    """Of less mass than with cells; a rounding error beside a member is of it, not of a lattice."""
    stress = without_cells(CASE).replace("[limits]\n", "[limits]\nsafety_factor = 2\n")
    monkeypatch.setitem(globals(), "CASE", stress)
    result, ended = ran(tmp_path / "void", cli, "", "max_iterations = 3")
    assert ended.code in (0, 4), ended.out + ended.err
    assert {row["name"].split()[0] for row in result["limits"]} == {"displacement", "stress"}
    stressed = {row["name"] for row in result["limits"] if row["name"].startswith("stress")}
    # One limit judges all there is: a body without passive solid has its row too.
    assert stressed == {"stress in passive solid", "stress in solid members"}
    assert not BodyStressLimit.may_lack
    assert result["lattice_mass_g"] == 0.0
    assert "buckling of cells" not in ended.out
    # Members that faces cut are thinner than a tetrahedron here: the first is predicted 38 % off.
    last = result["iterations"][-1]["limits"][0]
    assert abs(last["discrepancy"]) < 0.1
    assert "submodel" not in ended.out
    surface = meshio.read(tmp_path / "void" / "r" / "lattice.stl")
    a, b, c = surface.points[surface.cells_dict["triangle"]].swapaxes(0, 1)
    volume = float((a * np.cross(b, c)).sum() / 6.0)
    assert volume * 4.41e-3 == pytest.approx(result["mass_g"], rel=0.02)


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ("", 0),
        ("safety_factor = 2\n", 1),
        ("safety_factor = 2\npart_buckling = [{least = 2}]\n", 0),
    ],
)
def test_members_without_cells_may_buckle(tmp_path, cli, limits, told):
    """Nothing says whether they do, beside a limit of stress, unless the case asks for it."""
    text = without_cells(CASE).replace("[limits]\n", f"[limits]\n{limits}").replace("RUN", "")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("check", tmp_path, "--no-picture", "--json")
    assert ended.code == 0, ended.err
    warnings = json.loads(ended.out)["warnings"]
    assert len([w for w in warnings if "slender members buckle" in w]) == told


@pytest.mark.slow
def test_members_are_accepted_and_their_stress_is_a_row_of_its_own(tmp_path, cli):
    stress = 'acceptance = "whole"\nmax_iterations = 6'
    result, ended = ran(tmp_path / "case", cli, MEMBERS, stress)
    assert ended.code == 0, ended.out + ended.err
    assert result["status"] == "met"
    assert result["printed"]["volumes_mm3"]["solid members"] > 0
    last = result["iterations"][-1]["limits"][0]
    assert abs(last["discrepancy"]) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "members"), [("0.006 mm", True), ("1 mm", False)])
def test_a_skin_closes_a_body_of_members(tmp_path, cli, monkeypatch, limit, members):
    """Where the skin is enough there are no members, and nothing is lighter."""
    skin = 'skin = "0.6 mm"\ndrain = {diameter = "1.5 mm"}\n[run]'
    text = without_cells(CASE).replace("[run]", skin, 1).replace('"0.0125 mm"', f'"{limit}"')
    monkeypatch.setitem(globals(), "CASE", text)
    result, ended = ran(tmp_path / "closed", cli, "", "max_iterations = 4")
    assert ended.code == 0, ended.out + ended.err
    assert (result["status"], result["lightest"]) == ("met", True)
    found = result["printed"]["volumes_mm3"]
    assert found["skin"] > 0
    assert found.get("solid members", 0.0) > 0.05 * found["skin"] or not members
    assert found.get("solid members", 0.0) < 0.03 * found["skin"] or members  # fillets
    assert len(result["measures"]["drains"]) == 1


FLOATING = """\
[[keep]]
box = {lower = ["2.7 mm", "2.7 mm", "2.7 mm"], upper = ["5.3 mm", "5.3 mm", "5.3 mm"]}
[[load_case]]"""


@pytest.mark.slow
def test_kept_solid_that_cells_leave_alone_is_tied_in(tmp_path, cli, monkeypatch):
    """Struts run along the edges of the bar; a block in the middle of a cell touches none."""
    text = CASE.replace("[[load_case]]", FLOATING, 1).replace("gyroid-sheet", "sc")
    monkeypatch.setitem(
        globals(), "CASE", text.replace("[0.3, 0.7]", "[0.12, 0.6]").replace("0.0125", "0.03")
    )
    result, ended = ran(tmp_path / "tied", cli, MEMBERS, "max_iterations = 1")
    assert ended.code in (0, 4), ended.out + ended.err
    assert "members tie in what stands alone" in " ".join(ended.out.split())
    assert result["printed"]["comparison"]["printed"]["components"] == 1


@pytest.mark.slow
@pytest.mark.parametrize(("least", "made"), [("2.6 mm", "solid and void"), ("4 mm", "lattice")])
def test_of_all_three_phases_the_lighter_body_is_made(tmp_path, cli, least, made):
    """Thin members carry without cells; as thick as half of the bar they weigh more than these."""
    phases = f'phases = ["lattice", "solid", "void"]\nleast_member = "{least}"'
    result, ended = ran(tmp_path / "any", cli, phases, 'stop_after = "sizing"')
    assert ended.code == 0, ended.out + ended.err
    assert f"The run makes {made}" in " ".join(ended.out.split())
    # The lattice beside members, or a thousandth of its mass where void stands for it.
    assert (result["lattice_mass_g"] > 0.5) == (made == "lattice")
