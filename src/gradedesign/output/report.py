"""The report an engineer signs: one self-contained HTML file, verdict first."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from typing import Any

from gradedesign.output._html import percent, plain, table
from gradedesign.output.limit_notes import (
    allowed,
    measures_note,
    scope_words,
    solid_section,
    stress_note,
)

#: Nothing is loaded from outside and no script runs.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1b1f24;max-width:62rem;
margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem;margin:0 0 .2rem}h2{font-size:1.15rem;margin:2rem 0 .5rem;
border-bottom:1px solid #d0d7de}
table{border-collapse:collapse;width:100%;margin:.5rem 0}
th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #e4e8ec;vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.verdict{padding:1rem 1.2rem;border-radius:.4rem;margin:1rem 0;color:#fff}
.met{background:#1a7f37}.not_met,.infeasible,.failed{background:#b42318}.partial{background:#57606a}
.verdict b{font-size:1.3rem}.broken{color:#b42318;font-weight:600}
figure{margin:1rem 0}figure img{max-width:100%;border:1px solid #d0d7de}
figcaption{color:#57606a}pre{background:#f6f8fa;padding:1rem;overflow:auto;font-size:13px}
.sign{display:flex;gap:3rem;margin-top:2rem}.sign div{flex:1;border-top:1px solid #1b1f24}
"""

_STATUS = {
    "met": "MET",
    "not_met": "NOT MET",
    "infeasible": "INFEASIBLE",
    "partial": "PARTIAL: nothing is proven",
    "failed": "FAILED",
}

#: What ended a run, after "because".
_ENDED = {
    "tight": "the accepted design uses a limit to 97 % or more",
    "rounds": "its rounds were used up",
    "time": "its time was used up",
    "stuck": "the last round changed nothing",
    "saturated": "no density of this lattice can hold a limit",
    "solid": "the fully solid part breaks a limit",
    "stop_after": "the case asks for no more",
    "error": "of an error",
}

#: Stages that follow each other; others are parts of these.
_STAGES = ("part", "solid", "round", "explicit", "acceptance", "density", "lattice", "output")

_PICTURES = {
    "loads": "Supports and loads on the solid part",
    "density": "Relative density that sizing chose",
    "lattice": "The surface that is printed, as read back from the file",
    "stress": "Von Mises stress of the explicit analysis",
    "deformed": "Deformed lattice of the explicit analysis",
}


def render_report(result: Mapping[str, Any], pictures: Mapping[str, bytes], case_text: str) -> str:
    """Render the report.

    Parameters
    ----------
    result : mapping
        The content of result.json.
    pictures : mapping of name to PNG bytes
        Names as in result.json's ``files``.
    case_text : str
        The case file, printed as it was.

    Returns
    -------
    str
        HTML that opens without a network; all text from outside is escaped.
    """
    sections = [
        _verdict(result),
        _run(result),
        _limits(result),
        _masses(result),
        _iterations(result),
        _acceptance(result),
        _measures(result),
        _figures(pictures),
        _law(result),
        _warnings(result),
        _provenance(result),
        f"<h2>Case file</h2><pre>{escape(case_text)}</pre>",
        '<div class="sign"><div>Name</div><div>Date</div><div>Signature</div></div>',
    ]
    title = escape(str(result.get("case_name", "")))
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        f"<title>gradedesign: {title}</title><style>{_STYLE}</style></head><body>"
        f"<h1>{title}</h1>" + "".join(sections) + "</body></html>\n"
    )


def _verdict(result: Mapping[str, Any]) -> str:
    status = str(result["status"])
    lightest = ", lightest that was found" if result.get("lightest") else ""
    return (
        f'<div class="verdict {escape(status)}"><b>{_STATUS.get(status, escape(status))}'
        f"{lightest}</b><br>{escape(str(result['reason']))}</div>"
    )


def _run(result: Mapping[str, Any]) -> str:
    """How long the run took, what it was allowed, and what ended it."""
    budget, timing = result.get("budget") or {}, result.get("timing_s") or {}
    said = []
    rounds = len(result.get("iterations") or ())
    if rounds:
        most = f" of {budget['max_rounds']} at most" if "max_rounds" in budget else ""
        said.append(f"{rounds} round{'' if rounds == 1 else 's'}{most}")
    if timing:
        stages = [s for s in _STAGES if s in timing] or list(timing)
        seconds = sum(timing[s] for s in stages)
        if "round" not in timing:
            seconds += timing.get("sizing", 0.0)
        allowed = f" of {budget['time_s']:.0f} s" if "time_s" in budget else ""
        said.append(f"{seconds:.0f} s{allowed}")
    if ended := result.get("ended_by"):
        said.append(f"ended because {_ENDED.get(ended, ended)}")
    return f"<p>The run: {escape('; '.join(said))}.</p>" if said else ""


def _limits(result: Mapping[str, Any]) -> str:
    rows = [
        (
            row["name"],
            row["load_case"],
            f"{row['value']:.4g} {row['unit']}",
            allowed(row),
            f"{1 - row['use']:+.1%}",
            percent(row["resolution_error"]),
            "holds" if row["passed"] else "BROKEN",
            row["judged_by"],
        )
        for row in result["limits"]
    ]
    header = (
        "limit",
        "load case",
        "value",
        "allowed",
        "margin",
        "second mesh",
        "",
        "judged by",
    )
    limits = table(header, rows, numbers={2, 3, 4, 5})
    return "<h2>Limits</h2>" + limits + measures_note(result) + solid_section(result)


def _masses(result: Mapping[str, Any]) -> str:
    rows = [
        (label, f"{result[key]:{form}}")
        for label, key, form in (
            ("mass, g", "mass_g", ".5g"),
            ("of that the lattice, g", "lattice_mass_g", ".5g"),
            ("fully solid part, g", "solid_mass_g", ".5g"),
            ("share of the solid part's mass", "relative_density", ".1%"),
            ("mean relative density of the lattice", "lattice_density", ".3f"),
        )
        if result.get(key) is not None
    ]
    return "<h2>Mass</h2>" + table(("", ""), rows, numbers={1}) if rows else ""


def _iterations(result: Mapping[str, Any]) -> str:
    iterations = result.get("iterations") or ()
    rows = [
        (
            str(it["round"]),
            f"{it['mass_g']:.4g}",
            f"{it['mean_density']:.3f}",
            f"{it['use']:.1%}",
            *(percent(one["gap"]) for one in _measured(it)),
            f"{it['stiffness_factor']:.3f}",
            f"{it['dofs'] / 1e6:.2f}",
            f"{it['seconds']:.0f}",
        )
        for it in iterations
    ]
    if not rows:
        return ""
    note = (
        "<p>The gap is the explicit value over the homogenised prediction of the same design, made "
        "before its analysis, less one.</p>"
    )
    header = (
        "round",
        "mass g",
        "lattice density",
        "largest use",
        *(f"gap of {_label(one)}" for it in iterations[:1] for one in _measured(it)),
        "stiffness factor",
        "M unknowns",
        "s",
    )
    return "<h2>Rounds</h2>" + table(header, rows, numbers=set(range(len(header)))) + note


def _measured(iteration: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Limits of a round that its explicit analysis measures."""
    return [one for one in iteration["limits"] if one["explicit"] is not None]


def _label(limit: Mapping[str, Any]) -> str:
    """Name and load case of a limit, where it has one."""
    load_case = limit["key"]["load_case"]
    return f"{limit['name']} ({load_case})" if load_case else str(limit["name"])


def _acceptance(result: Mapping[str, Any]) -> str:
    data = result.get("acceptance") or {}
    if not data:
        return ""
    parts = [f"<p>Scope: {escape(data['scope'])}; {escape(scope_words(data))}.</p>"]
    rows = [
        (
            entry["limit"],
            entry["mesher"],
            entry["scope"],
            f"{entry['volume_mm3']:.4g}",
            ", ".join(f"{size:.3g}" for size in entry["mesh_sizes_mm"]),
            percent(entry["resolution_error"]),
        )
        for entry in data["limits"]
    ]
    header = ("limit", "mesher", "scope", "volume mm³", "mesh sizes mm", "difference")
    parts.append(table(header, rows, numbers={3, 5}))
    parts.append(_windows(data))
    return "<h2>What the verdict rests on</h2>" + "".join(parts)


def _windows(data: Mapping[str, Any]) -> str:
    rows = [
        (
            ", ".join(f"{c:.1f}" for c in w["centre_mm"]),
            w["load_case"],
            f"{w['value_MPa']:.4g}",
            f"{w['explicit_MPa']:.4g}",
            f"{w['force_gap']:.1%}",
            f"{w['energy_gap']:.1%}",
            "yes" if w["matches"] else "NO",
            str(w["tets"]),
        )
        for w in data["windows"]
    ]
    header = (
        "window at mm",
        "load case",
        "MPa",
        "explicit MPa",
        "force gap",
        "energy gap",
        "within 3 %",
        "tets",
    )
    return table(header, rows, numbers={2, 3, 4, 5, 7}) if rows else ""


def _measures(result: Mapping[str, Any]) -> str:
    rows = []
    for case, phases in (result.get("measures") or {}).items():
        for phase, m in phases.items():
            if isinstance(m, Mapping) and "share_above" in m:
                centre = ", ".join(f"{c:.1f}" for c in m["worst_cell_centre"])
                rows.append(
                    (
                        case,
                        phase,
                        f"{m['value']:.4g}",
                        f"{m['maximum']:.4g}",
                        f"{m['share_above']:.2%}",
                        f"{m['worst_cell']:.4g}",
                        centre,
                    )
                )
    if not rows:
        return ""
    header = (
        "load case",
        "phase",
        "percentile MPa",
        "maximum MPa",
        "above limit",
        "worst cell MPa",
        "at mm",
    )
    stresses = table(header, rows, numbers={2, 3, 4, 5})
    return "<h2>Stress by phase</h2>" + stresses + stress_note(result)


def _figures(pictures: Mapping[str, bytes]) -> str:
    figures = [
        f'<figure><img alt="{escape(name)}" src="data:image/png;base64,'
        f'{base64.b64encode(pictures[name]).decode("ascii")}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
        for name, caption in _PICTURES.items()
        if name in pictures
    ]
    return "<h2>Pictures</h2>" + "".join(figures) if figures else ""


def _law(result: Mapping[str, Any]) -> str:
    law = result.get("law") or {}
    rows = [
        (key.replace("_", " "), plain(value))
        for key, value in law.items()
        if value not in (None, "")
    ]
    return "<h2>Cell, law and material</h2>" + table(("", ""), rows) if rows else ""


def _warnings(result: Mapping[str, Any]) -> str:
    items = "".join(f"<li>{escape(str(w))}</li>" for w in result.get("warnings", []))
    return f"<h2>Warnings</h2><ul>{items}</ul>" if items else ""


def _provenance(result: Mapping[str, Any]) -> str:
    rows = [(name, str(version)) for name, version in (result.get("versions") or {}).items()]
    rows += [("plugin", p) for p in result.get("plugins", [])]
    rows += [(f"seconds, {k}", f"{v:.1f}") for k, v in (result.get("timing_s") or {}).items()]
    rows.append(("case hash", str(result.get("case_hash", ""))))
    return "<h2>Versions and time</h2>" + table(("", ""), rows)
