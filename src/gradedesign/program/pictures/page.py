"""The page that shows a scene: one HTML file, nothing loaded from elsewhere.

It holds three.js (MIT, ``page/three.LICENSE``), which ``page/bundle.mjs`` makes, and our own
``page/scene.js``. A browser without WebGL shows the still picture.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A mistake in a case.

    Attributes
    ----------
    message : str
    rows : sequence of (int, str, bool)
        Lines of the case around it: number, text, whether it stands there.
    is_open : bool
        Whether it is a case that its user has yet to finish.
    """

    message: str
    rows: Sequence[tuple[int, str, bool]] = ()
    is_open: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneHtml:
    """A scene as a part of a page."""

    style: str  #: For the head, the place of the scene, and the end of the body.
    body: str  #: As `style`.
    scripts: str  #: As `style`.
    #: Sources of a content security policy that let these scripts run, and no others.
    script_hashes: tuple[str, ...]


def scene_html(
    data: Mapping[str, Any],
    still: bytes | None,
    *,
    instead: str = "no picture was made",
    name: str = "scene",
) -> SceneHtml:
    """A scene with its data, its still picture (PNG) and the scripts that draw it.

    ``instead`` says what there is without a still picture; ``name`` is the element's, one of a
    page's own where there are several.
    """
    title = escape(str(data["title"]))
    # No character that could end the element: a name in a case may hold anything.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    picture = ""
    if still is not None:
        encoded = base64.b64encode(still).decode("ascii")
        picture = (
            f'<img class="still" alt="{title}, picture" src="data:image/png;base64,{encoded}">'
        )
        instead = "a still picture stands for the scene"
    body = (
        f'<section class="scene" id="{name}" aria-label="Scene of {title}">'
        f'<div class="stage">{picture}<p class="waiting">Preparing the scene…</p>'
        f'<p class="nowebgl">This browser draws no WebGL 2: {instead}.</p></div>'
        f'<div class="panel"></div>'
        f'<script type="application/json">{text}</script></section>'
    )
    library, own = _asset("three.min.js"), _asset("scene.js")
    scripts = (
        f"<!--\n{_asset('three.LICENSE')}-->\n<script>{library}</script>\n"
        f'<script type="module">{own}</script>'
    )
    return SceneHtml(
        style=_asset("scene.css"),
        body=body,
        scripts=scripts,
        script_hashes=tuple(_source(text) for text in (library, own)),
    )


def scene_page(
    data: Mapping[str, Any],
    still: bytes | None,
    *,
    words: Sequence[str] = (),
    problem: Problem | None = None,
) -> str:
    """A page of its own for a scene.

    - ``data``: title and layers, see `case_scene` and `run_scene`; without ``part`` there is no
      scene
    - ``still``: PNG that stands for it where it cannot be drawn
    - ``words``: lines below the title
    - ``problem``: what is wrong, before the scene
    """
    scene = scene_html(data, still)
    title = escape(str(data["title"]))
    lines = "".join(f"<p>{escape(line).replace('mm^3', 'mm³')}</p>" for line in words)
    body = f"<main>{scene.body}</main>"
    if "part" not in data:  # nothing can be drawn yet, but the page waits for the case to be mended
        body = body.replace('class="scene"', 'class="scene" hidden')
    policy = content_policy(scene.script_hashes, served=bool(data.get("watch")))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{title}</title><style>{_asset('page.css')}{scene.style}</style></head>\n"
        f"<body><header><h1>{title}</h1>{lines}</header>{_problem_html(problem)}{body}\n"
        f"{scene.scripts}</body></html>\n"
    )


def content_policy(script_hashes: Sequence[str], *, served: bool = False) -> str:
    """Nothing from elsewhere, no script but these; a served page may ask its own server."""
    sources = " ".join(script_hashes) or "'none'"
    asks = "; connect-src 'self'" if served else ""
    return (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {sources}{asks}"
    )


def _problem_html(problem: Problem | None) -> str:
    if problem is None:
        return ""
    rows = []
    for number, text, there in problem.rows:
        row = f"{number:4d}  {escape(text)}"
        rows.append(f"<mark>{row}</mark>" if there else row)
    lines = "\n".join(rows)
    shown = f"<pre>{lines}</pre>" if rows else ""
    title = "Some of the case is left to state." if problem.is_open else "The case has a mistake."
    words = f"<p><b>{title}</b> {escape(problem.message)}</p>"
    return f'<div class="problem" role="alert">{words}{shown}</div>'


def _source(script: str) -> str:
    digest = hashlib.sha256(script.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


@cache
def _asset(name: str) -> str:
    return (files("gradedesign.program.pictures") / "page" / name).read_text(encoding="utf-8")
