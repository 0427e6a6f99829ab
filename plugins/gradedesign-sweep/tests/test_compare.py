"""`gradedesign compare`: tables, data and page of runs that stand in folders."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from small_parts import SHORT_BAR

from gradedesign import load_case
from gradedesign.design.resolve.shown_case import shown_case
from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.files import write_result
from gradedesign.program.pictures.case_scene import case_scene
from gradedesign.program.store.stages import open_stages
from gradedesign_sweep.comparison import compared

CHROMIUM = Path("/usr/bin/chromium")
LOADS = {"name": "push & pull", "force_N": [0.0, 0.0, -100.0], "temperature_change_K": 0.0}


def limit(value, allowed=0.5, **more):
    return LimitRow(
        key=LimitKey(kind="displacement", region="tip", component="magnitude", load_case="push"),
        name="displacement of tip magnitude",
        load_case="push",
        value=value,
        limit=allowed,
        unit="mm",
        judged_by="a stand-in",
        **more,
    )


def stress(value, load_case="push"):
    return LimitRow(
        key=LimitKey(kind="stress", region="lattice"),
        name="stress in <lattice>",
        load_case=load_case,
        value=value,
        limit=50.0,
        unit="MPa",
        judged_by="a stand-in",
    )


def a_result(**more):
    """A run of 2 g of a part of 8 g: 2 cm3 of 4 g/cm3."""
    return RunResult(
        **{
            "status": "met",
            "lightest": True,
            "reason": "every limit holds",
            "ended_by": "tight",
            "mass_g": 2.0,
            "solid_mass_g": 8.0,
            "relative_density": 0.25,
            "lattice_density": 0.2,
            "limits": (limit(0.4), stress(45.0)),
            "printed": {"volumes_mm3": {"lattice": 375.0, "passive solid": 125.0}},
            "case_name": "bar",
            "law": {"name": "gyroid-sheet-computed", "cell": "gyroid-sheet"},
            "material": {"name": "Ti-6Al-4V", "density_g_cm3": 4.0},
            "load_cases": (LOADS,),
            **more,
        }
    )


@pytest.fixture
def run(tmp_path):
    """Write the folder of a finished run."""

    def write(name, scene=None, **more):
        folder = tmp_path / name
        with open_stages(folder, "a1b2c3", resume=False, overwrite=False) as out:
            files = {}
            if scene is not None:
                out.write_text("scene.json", json.dumps(scene))
                files["scene"] = "scene.json"
            write_result(out, a_result(folder=out.path, case_hash="a1b2c3", files=files, **more))
        return folder

    return write


def test_runs_stand_side_by_side(cli, run):
    first = run("first")
    banded = limit(0.45, band=Banded(value=0.45, low=0.44, high=0.48, sizes_mm=(1.0,)))
    second = run(
        "second", mass_g=1.0, relative_density=0.125, limits=(banded, stress(55.0, "pull"))
    )
    ended = cli("compare", first, second)
    assert ended.code == 0, ended.err
    lines = [" ".join(line.split()) for line in ended.out.splitlines()]
    assert any(line.startswith("1 first (bar) met, lightest 2 g 25.0% 90.0%") for line in lines)
    # 55 of 50 MPa: 110 %; the margin of what is banded is that of its high end, 0.48 of 0.5 mm.
    assert any(line.startswith("2 second (bar) met, lightest 1 g 12.5% 110.0%") for line in lines)
    assert "1 gyroid-sheet 0.200 75.0% 25.0%" in lines
    text = " ".join(lines)
    assert "+20.0% +4.0%" in text
    assert "+10.0% in" in text
    assert "-10.0% BROKEN" in text
    assert "2: MET, lightest: every limit holds" in text
    assert "note:" not in text


def test_data_of_a_comparison(cli, run):
    ended = cli("compare", run("a"), run("b", limits=(limit(0.1),), law={"name": "void"}), "--json")
    data = json.loads(ended.out)
    first, second = data["runs"]
    assert (first["run"], first["case"], first["cell"]) == (1, "bar", "gyroid-sheet")
    assert second["cell"] == "void"
    assert first["phases"] == {"lattice": 0.75, "passive solid": 0.25}
    assert [limit["margin"] for limit in first["limits"]] == [0.2, 0.1]
    assert [limit["load_case"] for limit in first["limits"]] == ["push", "push"]
    assert first["largest_utilisation"] == 0.9
    assert second["largest_utilisation"] == 0.2
    assert not first["non_dominated"]
    assert not second["non_dominated"]
    (note,) = data["notes"]
    assert "none is marked as best: stress in <lattice>" in note


def test_who_answers_the_same_question_is_ranked_and_who_does_not_is_told():
    base = a_result(folder=Path("a"))
    heavy = replace(base, folder=Path("b"), mass_g=3.0)
    assert compared([base, heavy]).best == {1}
    assert compared([base, heavy]).notes == []
    # 4 cm3 of part instead of 2 cm3.
    larger = compared([base, replace(heavy, solid_mass_g=16.0)])
    assert not larger.best
    assert (
        "different parts: 1 stated in the case, 2000 mm³; 2 stated in the case, 4000 mm³"
        in (larger.notes[0])
    )
    # 2e-5 is what meshes differ by.
    assert compared([base, replace(heavy, solid_mass_g=8.00016)]).best == {1}
    pulled = {**LOADS, "force_N": [0.0, 0.0, -110.0]}
    loads = compared([base, replace(heavy, load_cases=(pulled,))])
    assert not loads.best
    assert (
        "different loads: 1 push & pull (0, 0, -100) N; 2 push & pull (0, 0, -110) N"
        in (loads.notes[0])
    )
    files = {"part": {"bar.stl": "0123456789"}}
    assert (
        "2 bar.stl 01234567, 2000 mm³" in compared([base, replace(heavy, checksums=files)]).notes[0]
    )
    other = compared([base, replace(heavy, material={"name": "PA12", "density_g_cm3": 4.0})])
    assert other.notes == ["the runs have different materials: 1 Ti-6Al-4V; 2 PA12"]


def test_masses_of_a_mirrored_part_are_those_of_the_whole():
    half = a_result(folder=Path("a"), mass_g=1.0, solid_mass_g=4.0, symmetry={"copies": 2})
    both = compared([half, a_result(folder=Path("b"))])
    assert [(row.mass_g, row.solid_mass_g) for row in both.rows] == [(2.0, 8.0), (2.0, 8.0)]
    assert both.notes == ["masses of 1 are of the whole part, not of what was modelled"]


def test_allowed_values_that_differ_stand_in_the_cells(cli, run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    ended = cli("compare", run("a"), run("b", limits=(limit(0.4, 0.8), stress(45.0))))
    text = " ".join(ended.out.split())
    assert "differs push +20.0% of 0.5 mm +50.0% of 0.8 mm" in text


def test_a_run_that_failed_is_a_row(cli, run):
    failed = {"status": "failed", "lightest": False, "reason": "struts are too thin", "limits": ()}
    more = {"mass_g": None, "solid_mass_g": None, "material": {}, "load_cases": (), "printed": {}}
    ended = cli("compare", run("a"), run("b", **failed, **more))
    assert ended.code == 0
    assert "2: FAILED: struts are too thin" in ended.out
    assert "note:" not in ended.out


def test_what_is_no_finished_run_is_told(cli, run, tmp_path):
    first = run("first")
    (tmp_path / "empty").mkdir()
    with open_stages(tmp_path / "going", "a1", resume=False, overwrite=False):
        pass
    for words, message in (
        ((first,), "alone is no comparison"),
        ((first, first.parent / "going" / ".." / "first"), "are the same run"),
        ((first, tmp_path / "empty"), "empty is no run folder"),
        ((first, tmp_path / "nowhere"), "nowhere is no run folder"),
        ((first, tmp_path / "going"), "going holds no result.json: its run has not ended"),
    ):
        ended = cli("compare", *words)
        assert ended.code == 2
        assert message in ended.err


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """The scene of a bar, as a run of it would leave it."""
    folder = tmp_path_factory.mktemp("bar")
    text = SHORT_BAR + '[[load_case]]\nname = "push"\nfix = [{region = "root"}]\n'
    text += 'load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]\n'
    text += '[lattice]\ncell = "gyroid-sheet"\nsize = "8 mm"\ndensity = [0.45, 0.60]\n'
    text += '[limits]\ndisplacement = [{region = "tip", magnitude = "0.5 mm"}]\n'
    (folder / "case.toml").write_text(text, encoding="utf-8")
    registry = build_registry()
    case = load_case(folder / "case.toml", registry=registry)
    return case_scene(shown_case(case, registry), "bar")


def test_the_page_holds_tables_plot_and_scenes(cli, run, scene, tmp_path):
    page = tmp_path / "compare.html"
    runs = [run("a", scene), run("b", scene, case_name="<b>"), run("c", mass_g=3.0)]
    ended = cli("compare", *runs, "-o", page)
    assert f"page: {page}" in " ".join(ended.out.split())
    text = page.read_text(encoding="utf-8")
    assert "<b>)" not in text
    assert "b (&lt;b&gt;)" in text
    assert "<td>stress in &lt;lattice&gt;</td><td>50 MPa</td><td>push</td><td>+10.0%</td>" in text
    assert text.count('<section class="scene"') == 2
    assert 'id="scene-1"' in text
    assert 'id="scene-2"' in text
    assert text.count('"together":true') == 2
    assert text.count("<script>") == 1  # three.js once
    assert "c holds no scene.json" in text
    assert "data:image/png;base64" in text[text.index("Mass against") :]


@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"no {CHROMIUM}: apt-get install chromium")
def test_scenes_turn_together(cli, run, scene, tmp_path):
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no Playwright: pip install playwright"
    )
    page = tmp_path / "compare.html"
    cli("compare", run("a", scene), run("b", scene), "-o", page)
    flags = ["--headless", "--no-sandbox", "--use-angle=swiftshader"]
    flags.append("--enable-unsafe-swiftshader")
    cameras = "() => scenes.map((s) => [...s.camera.position.toArray(), s.camera.zoom])"
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=str(CHROMIUM), args=flags)
        opened = browser.new_page(viewport={"width": 1400, "height": 900})
        errors = []
        opened.on("pageerror", lambda error: errors.append(str(error)))
        opened.on("console", lambda said: errors.append(said.text) if said.type == "error" else 0)
        opened.goto(page.as_uri())
        live = opened.locator(".stage.live")
        playwright.expect(live).to_have_count(2, timeout=60_000)

        def settled(wanted):
            for _ in range(100):
                if wanted(opened.evaluate(cameras)):
                    return opened.evaluate(cameras)
                opened.wait_for_timeout(100)
            raise AssertionError(opened.evaluate(cameras))

        before = settled(lambda c: c[0] == pytest.approx(c[1]) and c[0][3] != 1.0)  # fitted
        opened.locator("#scene-2 canvas").press("ArrowRight")
        opened.locator("#scene-2 canvas").press("+")
        after = settled(lambda c: c[0] == pytest.approx(c[1]) and c[0] != before[0])
        assert after[1][3] == pytest.approx(1.15 * before[1][3])
        assert abs(after[0][0] - before[0][0]) > 1.0
        opened.locator("#scene-1 .views button", has_text="Cells").click()
        shown = opened.locator("#scene-2 .views button[aria-pressed=true]")
        playwright.expect(shown).to_have_text("Cells")
        browser.close()
    assert errors == []
