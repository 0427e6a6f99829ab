"""Sentences of the report that connect limits, values, the picture and the printed surface."""

import re
from dataclasses import replace
from html import unescape

import pytest

from gradedesign.design.verdict.result import RunResult, scope_words
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands.run import print_verdict
from gradedesign.program.outputs.report import render_report
from gradedesign.program.outputs.sections import builtin_sections


def measure(value, maximum, share=0.004):
    return {"value": value, "maximum": maximum, "share_above": share, "worst_cell": maximum / 2,
            "worst_cell_centre": [1.0, 2.0, 3.0]}  # fmt: skip


SOLID_ROW = LimitRow(
    key=LimitKey(kind="displacement", region="tip", load_case="pull"),
    name="displacement of tip magnitude",
    load_case="pull",
    value=0.7123,
    limit=1.4246,
    unit="mm",
    judged_by="solid analysis",
    stated="2 x solid",
)
RESULT = RunResult(
    status="met",
    lightest=False,
    reason="holds",
    limits=(
        replace(
            SOLID_ROW,
            value=1.0,
            limit=2.0,
            judged_by="explicit analysis",
            measure="largest nodal value on the region",
        ),
        LimitRow(
            key=LimitKey(kind="stress", region="lattice"),
            phase="lattice",
            name="stress in lattice",
            load_case="pull",
            value=44.0,
            limit=50.0,
            unit="MPa",
            judged_by="submodels",
            measure="percentile 99.5 of the volume outside the exclusion radius",
            band=Banded(value=44.0, low=41.0, high=47.5, sizes_mm=(2.0, 1.3)),
        ),
    ),
    solid=(SOLID_ROW,),
    files={"stress": "stress.png"},
    measures={"pull": {"lattice": measure(40.0, 147.0)}, "cell_map": {"name": "uniform"}},
    acceptance={
        "scope": "submodels",
        "share_of_volume": 0.021,
        "limits": [],
        "submodels": [],
        "exclusion": {
            "radius_mm": 22.0,
            "percentile": 99.5,
            "share_of_volume": {"lattice": 0.381, "passive solid": 1.0},
            "stress_ratio": {"lattice": 1.1},
            "stress_everywhere_MPa": {"pull": {"lattice": 61.5, "passive solid": 12.0}},
            "maximum_everywhere_MPa": {"pull": {"lattice": 212.0, "passive solid": 31.0}},
        },
    },
)


def text_of(html):
    return re.sub(r"\s+", " ", unescape(re.sub("<[^>]*>", " ", html)))


@pytest.fixture
def report():
    return text_of(render_report(RESULT, {}, ""))


def test_one_stress_decides_and_the_others_say_what_they_are(report):
    """All on one basis: those of the analysis, 40 and 147 MPa, times 1.1 by the submodels."""
    limits, stress = report.split("Stress: what each number is")
    assert "stress in lattice pull 47.5 MPa 50 MPa 95.0% holds 41 to 47.5 submodels" in limits
    for other in ("44 MPa", "161.7", "61.5", "212"):
        assert other not in limits
    for words in (
        "decides: the high end of the band, beside 50 MPa 47.5",
        "expected: percentile 99.5 of the volume outside the exclusion radius: 40 MPa by finite "
        "cells, times 1.100 by the submodels 44",
        "the same percentile in the worst neighbourhood of one cell, about (1.0, 2.0, 3.0) mm "
        "80.85",
        "and is not judged 161.7",
        "exceeded by as much volume as the expected one, these zones included 61.5",
        "make it grow without end 212",
        "0.40% of the judged volume is above the limit, before that factor.",
        "The picture of the stress",
    ):
        assert words in stress


def test_without_windows_no_factor_is_named():
    row, exclusion = replace(RESULT.limits[1], value=40.0), RESULT.acceptance["exclusion"]
    acceptance = {**RESULT.acceptance, "exclusion": {**exclusion, "stress_ratio": {"lattice": 1.0}}}
    html = render_report(replace(RESULT, limits=(row,), acceptance=acceptance), {}, "")
    assert "times" not in text_of(html)


def test_the_exclusion_radius_stands_with_its_share_and_both_stresses(report):
    for words in ("Within 22 mm of the held regions", "lattice 38.1%, passive solid 100.0%"):
        assert words in report


def test_displacements_are_said_to_be_largest_nodal_values(report):
    assert "displacement of tip magnitude: largest nodal value on the region" in report
    assert "2 mm (2 x solid)" in report


def test_the_solid_part_stands_beside(report):
    assert "displacement of tip magnitude pull 0.7123 mm 1.425 mm (2 x solid) 50.0%" in report


def test_windows_do_not_claim_the_whole_surface(report):
    words = scope_words({**RESULT.acceptance, "submodels": [{}, {}]})
    assert "an independent mesher meshed it again in its 2 most stressed submodels" in words
    assert "(2.1% of the printed volume)" in words
    assert "analysed by finite cells at two resolutions or more" in report
    whole = scope_words({"scope": "whole", "share_of_volume": 0.999, "submodels": []})
    assert "judged on the whole printed surface" in whole
    assert "99.9%" in whole


def test_results_without_values_have_no_notes():
    failed = text_of(render_report(RunResult(status="failed", lightest=False, reason=""), {}, ""))
    for words in ("How values are taken", "Fully solid part", "what each number is"):
        assert words not in failed
    none = scope_words(
        {"scope": "none", "share_of_volume": 0.0, "submodels": [], "limits": [{"unit": "MPa"}]}
    )
    assert none.endswith(
        "no submodels were meshed again, since a limit is broken whatever they show"
    )
    unstressed = scope_words(
        {"scope": "none", "share_of_volume": 0.0, "submodels": [], "limits": [{"unit": "mm"}]}
    )
    assert unstressed.endswith("since no limit is on stress, which alone they judge")
    assert scope_words({}) == ""


def test_the_last_lines_of_a_run_say_the_share(capsys):
    result = RunResult(status="met", lightest=True, reason="holds", acceptance=RESULT.acceptance)
    print_verdict(result)
    printed = capsys.readouterr().out
    assert "(2.1% of the printed volume)" in printed
    print_verdict(RunResult(status="partial", lightest=False, reason="stopped"))
    assert "printed surface" not in capsys.readouterr().out


def test_the_most_used_limit_of_a_stress_stands_over_its_numbers_and_curves_have_their_source():
    stress = RESULT.limits[1]
    cycles = replace(
        stress, key=LimitKey(kind="fatigue", region="lattice", load_case="pull"),
        name="fatigue in lattice", limit=48.0, stated="1e+06 cycles at R = 0.1, as-built",
    )  # fmt: skip
    curve = {"surface": "as-built", "ratio": -1, "cycles": [1e4, 1e6], "walker": 0.5,
             "amplitude_MPa": [60.0, 30.0], "source": "12 specimens"}  # fmt: skip
    material = {"name": "alloy", "fatigue": [curve]}
    for limits, note in (
        ((cycles, stress), "0.40% of the judged volume is above the limit"),
        ((cycles, replace(stress, limit=40.0)), "0.40% of the judged volume is above the limit"),
        ((replace(cycles, load_case="push"), stress), "above 48 MPa, the least limit of any"),
    ):
        result = replace(RESULT, limits=limits, material=material)
        page = text_of(render_report(result, {}, "", sections=builtin_sections()))
        numbers = page.split("Stress: what each number is")[1]
        most = max((row for row in limits if row.load_case == "pull"), key=lambda r: r.utilisation)
        assert f"{most.name} (pull)" in numbers
        assert f"beside {most.limit:.4g} MPa" in numbers
        assert note in numbers
    assert "S-N curve, as-built amplitude 60.0, 30.0 MPa for 10000.0, 1000000.0 cycles" in page
    assert "12 specimens" in page
