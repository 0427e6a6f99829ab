"""The page of a comparison: its tables, mass against limits, and scenes that turn together."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape

from gradedesign import CaseError
from gradedesign.commands import (
    RunResult,
    content_policy,
    figure_png,
    scene_html,
    stored_scene,
    stored_still,
)
from gradedesign_sweep.comparison import Cells, Comparison, bodies_table, margins_table
from gradedesign_sweep.sweep_files import tradeoff_points
from gradedesign_sweep.table import BEST_WORDS, DesignRow, designs_table, limit_units
from gradedesign_sweep.tradeoff_plot import tradeoff_figure

#: Runs whose scenes are shown: browsers keep 16 drawing contexts, and a scene may take 10 MB.
_MOST_SCENES = 8
#: Verdicts that the page shows in red.
_BAD = ("BROKEN", "UNSURE", "UNJUDGED")

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1b1f24;background:#fff;margin:1.5rem auto;
padding:0 1.2rem;max-width:100rem}
h1{font-size:1.4rem;margin:0 0 .5rem}h2{font-size:1.1rem;margin:1.8rem 0 .4rem}
.wide{overflow-x:auto}table{border-collapse:collapse;margin:.4rem 0}
th,td{text-align:left;padding:.25rem .8rem .25rem 0;border-bottom:1px solid #e4e8ec;
vertical-align:top;font-variant-numeric:tabular-nums}
td.broken{color:#b42318;font-weight:600}.note{border-left:4px solid #9a6700;padding-left:.7rem}
.scenes{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(34rem,100%),1fr));gap:1.2rem}
.scenes h3{font-size:1rem;margin:0 0 .3rem}.scenes .scene{grid-template-columns:minmax(0,1fr)}
.scenes .stage{height:26rem}.scenes .panel{border-left:0;border-top:1px solid #d0d7de;
max-height:16rem}
img.plot,.scenes img.alone{max-width:100%}
@media print{.scenes .stage{height:auto}}
"""


def comparison_page(comparison: Comparison) -> str:
    """One HTML file that opens without a network; all text from outside is escaped."""
    rows = comparison.rows
    title = "Comparison of " + ", ".join(row.label for row in rows)
    runs = [
        f"<p><b>{row.number}</b> {escape(row.label)}, {escape(row.folder)}: "
        f"{escape(result.verdict)}</p>"
        for row, result in zip(rows, comparison.results, strict=True)
    ]
    body = [
        f"<h1>{escape(title)}</h1>",
        _table(designs_table("run", rows, comparison.best)),
        f"<p>{BEST_WORDS}</p>" if comparison.best else "",
        *(f'<p class="note">{escape(note)}</p>' for note in comparison.notes),
        *runs,
    ]
    scenes, scripts, style, hashes = _scenes(rows, comparison.results)
    body += ["<h2>Scenes</h2>", f'<div class="scenes">{scenes}</div>']
    if comparison.has_limits:
        body += [
            "<h2>Margins</h2><p>Shares of the allowed value that are left, by the unfavourable end "
            "of the band.</p>",
            _table(margins_table(comparison)),
        ]
    body += ["<h2>What they weigh</h2>", _table(bodies_table(comparison)), _plot(comparison)]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{content_policy(hashes)}">'
        f"<title>{escape(title)}</title><style>{style}{_STYLE}</style></head>\n"
        f"<body>{''.join(body)}\n{scripts}</body></html>\n"
    )


def _table(table: Cells) -> str:
    columns, cells = table
    head = "".join(f"<th>{escape(name) or '#'}</th>" for name in columns)
    lines = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in cells)
    table_html = f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table>"
    return f'<div class="wide">{table_html}</div>'


def _cell(text: str) -> str:
    bad = ' class="broken"' if any(word in text.split() for word in _BAD) else ""
    return f"<td{bad}>{escape(text)}</td>"


def _plot(comparison: Comparison) -> str:
    """Mass against the use of each limit, as a picture."""
    rows = comparison.rows
    groups = {row.number: f"{row.number}: {row.label}" for row in rows}
    points = tradeoff_points(rows, comparison.best, groups)
    if not points:
        return ""
    shared = [n for n in limit_units(rows) if sum(n in row.limits for row in rows) > 1]
    if not shared:
        return ""
    figure = tradeoff_figure(points, shared, title="", note="")
    text = base64.b64encode(figure_png(figure)).decode("ascii")
    return (
        "<h2>Mass against the use of each limit that two runs or more have</h2>"
        f'<img class="plot" alt="mass against the use of each limit, a panel for each" '
        f'src="data:image/png;base64,{text}">'
    )


def _scenes(
    rows: Iterable[DesignRow], results: Iterable[RunResult]
) -> tuple[str, str, str, tuple[str, ...]]:
    """Scenes of the runs, then the scripts, the style and the hashes that they share."""
    bodies, scripts, style = [], "", ""
    hashes: tuple[str, ...] = ()
    for row, result in zip(rows, results, strict=True):
        title = f"<h3>{row.number}: {escape(row.label)}</h3>"
        still = stored_still(result)
        try:
            data = stored_scene(result.folder)
            missing = f"a page shows the scenes of the first {_MOST_SCENES} runs"
        except CaseError as error:
            data, missing = {}, str(error)
        if not data or row.number > _MOST_SCENES:
            bodies.append(f"<div>{title}<p>{escape(missing)}</p>{_alone(still, row.label)}</div>")
            continue
        shown = {**data, "title": row.label, "embedded": True, "together": True}
        scene = scene_html(shown, still, name=f"scene-{row.number}")
        scripts, style, hashes = scene.scripts, scene.style, scene.script_hashes
        bodies.append(f"<div>{title}{scene.body}</div>")
    return "".join(bodies), scripts, style, hashes


def _alone(still: bytes | None, label: str) -> str:
    if still is None:
        return ""
    text = base64.b64encode(still).decode("ascii")
    return f'<img class="alone" alt="{escape(label)}, picture" src="data:image/png;base64,{text}">'
