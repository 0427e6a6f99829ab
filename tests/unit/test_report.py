"""The report: verdict first, every number of result.json, nothing from outside."""

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import jinja2
import pytest

from gradedesign.design.check.price import PricedBody
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.outputs.report import render_report
from gradedesign.program.outputs.sections import builtin_sections

PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)

RESULT = RunResult(
    status="met",
    lightest=True,
    reason="every limit holds <b>",
    case_name="<script>alert(1)</script>",
    case_hash="abc123",
    limits=(
        LimitRow(
            key=LimitKey(kind="stress", region="lattice"),
            phase="lattice",
            name="stress in lattice",
            load_case="pull & push",
            value=41.23,
            limit=50.0,
            unit="MPa",
            judged_by="submodels",
            band=Banded(value=41.23, low=40.1, high=43.9, sizes_mm=(1.5, 1.0)),
        ),
        LimitRow(
            key=LimitKey(kind="displacement", region="tip", load_case="side"),
            name="displacement of tip",
            load_case="side",
            value=2.1,
            limit=2.0,
            unit="mm",
            judged_by="explicit analysis",
        ),
    ),
    mass_g=12.345,
    lattice_mass_g=8.7654,
    solid_mass_g=50.0,
    relative_density=0.2469,
    lattice_density=0.175,
    iterations=(
        Iteration(
            number=1,
            mass_g=12.345,
            lattice_mass_g=8.7654,
            mean_density=0.175,
            limits=(
                LimitIteration(
                    key=LimitKey(kind="displacement", region="tip", load_case="side"),
                    name="displacement of tip",
                    unit="mm",
                    predicted=2.0,
                    explicit=2.024,
                    discrepancy=0.012,
                    factor=1.0,
                ),
            ),
            utilisation=0.99,
            passed=True,
            stiffness_factor=1.05,
            dofs=1234567,
            mesh_size_mm=0.5,
            spacing_mm=0.5,
            seconds=33.0,
            sizing_iterations=20,
            sizing_converged=True,
        ),
    ),
    acceptance={
        "scope": "submodels",
        "share_of_volume": 0.12,
        "limits": [
            {
                "limit": "stress in lattice",
                "mesher": "pytetwild",
                "scope": "submodels",
                "volume_mm3": 123.0,
                "mesh_sizes_mm": [0.5, 0.625],
                "value": 41.23,
                "unit": "MPa",
                "low": 40.1,
                "high": 43.9,
                "order": "unknown",
            }
        ],
        "submodels": [
            {
                "centre_mm": [1.0, 2.0, 3.0],
                "load_case": "pull & push",
                "value_MPa": 41.0,
                "driving_MPa": 40.0,
                "drive_factor": 1.037,
                "force_discrepancy": 0.011,
                "energy_discrepancy": 0.041,
                "matches": False,
                "enlarged": True,
                "tets": 1000,
            }
        ],
    },
    printed={
        "volumes_mm3": {"lattice": 3000.0},
        "joints_mm3": 12.5,
        "thickness_percentiles_mm": {"0.1": 0.123, "1": 0.41, "5": 0.62, "50": 1.07},
        "thickness_method": "length of a ray",
        "thickness_rays": 100_000,
        "comparison": {
            "elements_mm3": 2990.5,
            "analysed": {
                "volume_mm3": 2950.0,  # of the surface contoured for it: not what is compared
                "components": 1,
                "cavities": 0,
                "handles": 76,
                "triangles": 4321,
            },
            "printed": {
                "volume_mm3": 3012.25,
                "components": 1,
                "cavities": 0,
                "handles": 79,
                "triangles": 98765,
            },
            "distance_mm": 0.345,
            "at_mm": (1.0, 2.0, 3.5),
            "farther": "printed",
            "mean_distance_mm": 0.012,
            "samples": 55_555,
            "element_mm": 0.25,
            "volume_difference": 0.00727,
        },
    },
    law={"name": "a-law", "source": "Someone 2022, table 1", "window": [0.1, 0.6]},
    warnings=("a warning with <angle>",),
    versions={"gradedesign": "0.1.0"},
    plugins=("acme 1.2",),
    timing_s={"iteration": 33.0},
    bodies=(
        PricedBody(name="uniform lattice", mass_g=14.25, largest_utilisation=0.998),
        PricedBody(name="graded lattice", mass_g=11.75, largest_utilisation=0.999, asked=True),
        PricedBody(name="solid and void", mass_g=None, largest_utilisation=None, note="no <time>"),
    ),
    why_lattice="lattice fills the part",
)


def text_of(html):
    return re.sub(r"\s+", " ", unescape(re.sub("<[^>]*>", " ", html)))


class Checker(HTMLParser):
    """Collects tags and what they load; every opened tag must be closed."""

    VOID = ("meta", "img", "br")

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.loads = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.loads += [value for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture
def html():
    text, sections = 'name = "</pre><script>"', builtin_sections()
    return render_report(RESULT, {"loads": PNG, "other": PNG}, text, sections=sections)


def test_it_is_well_formed_and_loads_nothing(html):
    checker = Checker()
    checker.feed(html)
    assert checker.open == []
    assert "script" not in checker.tags
    assert all(value.startswith("data:image/png;base64,") for value in checker.loads)
    assert len(checker.loads) == 1
    assert "http" not in html.replace("http-equiv", "")
    assert "default-src 'none'" in html


def test_text_from_outside_is_escaped(html):
    assert "<script" not in html
    assert html.count("&lt;script&gt;") >= 2
    assert "pull &amp; push" in html
    assert "a warning with &lt;angle&gt;" in html
    assert "every limit holds &lt;b&gt;" in html


def test_the_verdict_comes_first(html):
    body = html[html.index("<body>") :]
    assert body.index("MET, lightest") < body.index("<h2>Limits") < body.index("<h2>Mass")


def test_limits_have_one_value_the_end_of_the_band_that_is_used(html):
    html = html.replace("\u00a0", " ")
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    cells = [[re.sub("<.*?>", "", c) for c in re.findall(r"<td.*?</td>", row)] for row in rows]
    assert [
        "stress in lattice", "pull &amp; push", "43.9 MPa", "50 MPa", "87.8%", "holds",
        "40.1 to 43.9", "submodels",
    ] in cells  # fmt: skip
    assert [
        "displacement of tip", "side", "2.1 mm", "2 mm", "105.0%", "BROKEN", "–",
        "explicit analysis",
    ] in cells  # fmt: skip
    # The expected value stands with what the verdict rests on.
    assert "41.23" not in html[: html.index("<h2>What the verdict rests on")]
    assert "41.23 MPa" in html


def test_other_bodies_at_the_same_limits_stand_beside_the_one_that_was_built(html):
    words = text_of(html)
    built = "the one that was built and accepted weighs 12.35 g by its file. No other was built."
    assert built in words.replace("\xa0", " ")
    assert "uniform lattice 14.25 99.8% graded lattice 11.75 99.9% asked for" in words
    assert "solid and void – – no <time>" in words
    assert "lattice fills the part" in words
    broken = render_report(replace(RESULT, status="not_met"), {}, "")
    assert "built and accepted" not in broken
    assert "Price of lattice" not in render_report(replace(RESULT, bodies=()), {}, "")


def test_what_an_engineer_signs_comes_first(html):
    """Verdict, limits, warnings, mass, pictures; the rest, folded, is how they were found."""
    opened = re.findall(r"<details( open)?><summary><h2>(.*?)</h2>", html)
    assert [name for state, name in opened if state] == ["Limits", "Warnings", "Pictures"]
    assert html.count("<details") == html.count("</details>") == len(opened) > 10
    first = (
        "<h2>Limits",
        "<h2>Warnings",
        "<h2>Mass",
        "<h2>Pictures",
        "<h2>The printed file",
        "<h2>Iterations",
    )
    places = [html.index(heading) for heading in first]
    assert places == sorted(places)


def test_low_values_that_are_unfavourable_are_told_apart(html):
    row = replace(
        RESULT.limits[0], unfavourable="low", name="frequency", unit="Hz", limit=30.0, phase=""
    )
    low = text_of(render_report(replace(RESULT, limits=(row,)), {}, ""))
    assert "frequency pull & push 40.1 Hz 30 Hz 74.8% holds 40.1 to 43.9" in low
    assert "(the low one of frequency)" in low
    assert "the low one" not in html


@pytest.mark.parametrize(
    "words",
    ["12.345", "8.7654", "24.7%", "0.175", "+1.2%", "1.23", "12.0%", "4.1%", "acme 1.2", "abc123",
     "Someone 2022, table 1", "0.1 to 0.6", "1.0, 2.0, 3.0",
     # The printed file, beside what was analysed.
     "0.123", "1.07", "100000 rays", "2990.5", "3012.25", ">76<", ">79<", "+0.7%", "0.345",
     "0.012", "1.0, 2.0, 3.5", "55555", "0.25 mm"],
)  # fmt: skip
def test_every_number_is_there(html, words):
    assert words in html


def test_the_run_says_what_it_took_and_what_ended_it(html):
    assert "<p>The run: 1 iteration; 33 s.</p>" in html
    ended = replace(
        RESULT,
        ended_by="time",
        budget={"time_s": 900.0, "max_iterations": 6},
        # The parts of an iteration are not counted again.
        timing_s={"part": 2.0, "iteration": 600.0, "sizing": 300.0, "acceptance": 98.0},
    )
    assert (
        "<p>The run: 1 iteration of 6 at most; 700 s of 900 s; "
        "ended because its time was used up.</p>" in render_report(ended, {}, "")
    )


def test_every_displacement_limit_has_a_column_of_its_own(html):
    assert '<th class="n">discrepancy of displacement of tip (side)</th>' in html
    (one,) = RESULT.iterations[0].limits
    more = replace(one, key=replace(one.key, load_case="pull"), discrepancy=-0.034)
    only_predicted = replace(one, name="buckling of cells", explicit=None, discrepancy=None)
    iteration = replace(RESULT.iterations[0], limits=(one, more, only_predicted))
    html = render_report(replace(RESULT, iterations=(iteration,)), {}, "")
    assert "discrepancy of displacement of tip (pull)" in html
    assert "discrepancy of buckling" not in html
    assert '<td class="n">+1.2%</td><td class="n">-3.4%</td>' in html


def test_a_window_that_does_not_match_stands_out(html):
    assert '<span class="broken">NO</span>' in html


def test_kept_triangles_of_the_part_are_said(html):
    assert "triangles of the part are in it" not in html
    kept = {**RESULT.printed, "outer": {"triangles": 2092, "kept": "bytes"}}
    words = "The 2092 triangles of the part are in it as they are, byte for byte."
    assert words in render_report(replace(RESULT, printed=kept), {}, "")


def test_a_result_without_lattice_has_no_empty_sections():
    bare = RunResult(
        status="infeasible", lightest=False, reason="too weak", limits=RESULT.limits, case_name="x"
    )
    html = render_report(bare, {}, "")
    assert "INFEASIBLE" in html
    for heading in ("Iterations", "What the verdict rests on", "Pictures", "Warnings", "Mass"):
        assert f"<h2>{heading}" not in html


def test_what_a_result_lacks_is_an_error_not_an_empty_place():
    entry = {k: v for k, v in RESULT.acceptance["limits"][0].items() if k != "mesher"}
    lacking = replace(RESULT, acceptance={**RESULT.acceptance, "limits": [entry]})
    with pytest.raises(jinja2.UndefinedError, match="mesher"):
        render_report(lacking, {}, "")


def test_the_tightest_limits_name_their_load_case_where_there_are_several():
    first = next(row for row in RESULT.limits if row.key.load_case)
    other = replace(first, key=replace(first.key, load_case="pull"))
    text = unescape(render_report(replace(RESULT, limits=(first, other)), {}, ""))
    name, used = first.name, f"{first.utilisation:.1%}"
    assert f"{name} ({first.key.load_case}) {used}, {name} (pull) {used}." in text
    alone = unescape(render_report(replace(RESULT, limits=(first,)), {}, ""))
    assert f"tightest limits: {name} {used}." in alone
