"""Scene of a case as the page draws it: the part with its faces, regions, supports and loads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, plain_vector
from gradedesign.design.resolve.load_balance import load_case_data
from gradedesign.design.resolve.shown_case import CaseShown
from gradedesign.geometry.part.face_words import described_faces
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.triangles.surface_mesh import corner_points
from gradedesign.program.pictures.action_mark import ActionMark, DrawnAction, drawn_actions
from gradedesign.program.pictures.marks import action_marks, region_marks, warming_note
from gradedesign.program.pictures.packed import packed, packed_corners, packed_mesh, quantised
from gradedesign.program.pictures.pictures import about_arrows, loads_still
from gradedesign.program.pictures.region_mark import (
    COLOURS,
    HATCH,
    ROLES,
    RegionMark,
    anchor_point,
    lifted,
)
from gradedesign.program.pictures.scene import Layer, hatch, sharp_edges
from gradedesign.program.pictures.volume import Volume, cells_data, volume_of

#: Strokes shorter than this share of the part's diagonal are drawn as stray points. Chosen, not
#: measured.
_POINT = 1e-3
#: By how much a line of action leaves the part's box, over the diagonal. Chosen, not measured.
_BEYOND = 0.12
#: Resultants below this share of what acts leave no line of action. Chosen, not measured.
_NO_FORCE = 1e-6


def case_scene(shown: CaseShown, title: str, volume: Volume | None = None) -> dict[str, Any]:
    """Data of the scene of a case, as ``page/scene.js`` reads them.

    ``volume`` is that of its domain, where it was made already.
    """
    part = shown.part
    loads = load_case_data(shown.load_cases[: len(shown.balances)], shown.balances)
    data = {"title": title, **_part_scene(part)}
    data |= _marks_scene(
        part, _all_regions(part, _regions(shown)), action_marks(shown.load_cases, part), loads
    )
    views = [{"id": "case", "title": "Part and loads", "body": "part", "note": data.pop("scale")}]
    volumes: dict[str, Any] = {}
    if shown.domain is not None:
        volume = volume_of(shown.domain) if volume is None else volume
        volumes["cells"] = cells_data(volume, shown.domain, shown.cell_map, bool(shown.cells))
        note = f"{shown.cells}; neighbouring cells in two tones"
        if shown.cell_map is None:
            note = f"{shown.cells}; their sizes follow the design, which a run finds"
        view = {"id": "cells", "title": "Cells", "body": "part", "volume": "cells", "note": note}
        views.append(view if shown.cells else {**view, "title": "Phases", "note": ""})
    return {**data, "views": views, "volumes": volumes}


def case_still(shown: CaseShown, title: str) -> bytes | None:
    """The picture of the loading that stands for the scene, PNG."""
    marks, actions = _regions(shown), action_marks(shown.load_cases, shown.part)
    note = warming_note(shown.load_cases)
    return loads_still(shown.part.surface, marks, actions, title, note)


def _regions(shown: CaseShown) -> list[RegionMark]:
    return region_marks(shown.load_cases, shown.part, shown.domain, shown.support_zones)


def _part_scene(part: Part) -> dict[str, Any]:
    """The part: its triangles, the face of each, what is known of every face, its sharp edges."""
    surface, faces = part.surface, part.faces
    edges = sharp_edges(Layer(vertices=surface.vertices, faces=surface.faces))
    return {
        "box": [plain_vector(end(surface.vertices, axis=0)) for end in (np.min, np.max)],
        "part": {**packed_mesh(surface), "labels": packed(faces.label, 32)},
        "edges": quantised(edges.reshape(-1, 3)),
        "faces": [asdict(face) for face in described_faces(surface, faces, part.file_faces)],
    }


def _marks_scene(
    part: Part,
    regions: Sequence[RegionMark],
    actions: Sequence[ActionMark],
    load_cases: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Regions, supports and loads on the part.

    ``regions``, ``actions``: as the picture of the loading shows them; ``load_cases``: plain data
    of supports, loads and resultants, as ``check --json`` and result.json hold.
    """
    drawn = drawn_actions(actions, part.diagonal)
    scale = about_arrows(drawn, actions)
    marks = [mark for mark in regions if len(mark.corners)]
    colours = {action.action.load_case: action.colour for action in drawn}
    return {
        "scale": f"{scale[:1].upper()}{scale[1:]}.".removeprefix("."),
        "regions": [_region_data(part, mark) for mark in marks],
        "cases": [
            {
                "name": case["name"],
                "colour": colours.get(case["name"], "#57606a"),
                "facts": list(_case_facts(case, part.diagonal)),
                "line": _line_of_action(part, case),
                "actions": [_action_data(a) for a in drawn if a.action.load_case == case["name"]],
            }
            for case in load_cases
        ],
    }


def _all_regions(part: Part, marks: Sequence[RegionMark]) -> list[RegionMark]:
    """Marks, and one for every region of the part that has none yet."""
    marked = {_region_name(mark) for mark in marks}
    rest = [
        RegionMark(name=name, role="region", corners=region.corners)
        for name, region in part.regions.items()
        if name not in marked
    ]
    return [*marks, *rest]


def _region_name(mark: RegionMark) -> str:
    """The region's name in the case, without what else its label says."""
    return mark.name.partition(",")[0]


def _region_data(part: Part, mark: RegionMark) -> dict[str, Any]:
    strokes: FloatArray = np.zeros((0, 2, 3))
    if mark.role == "support":
        strokes = hatch(lifted(mark, part.diagonal), HATCH * part.diagonal)
        length = np.linalg.norm(strokes[:, 1] - strokes[:, 0], axis=1)
        strokes = strokes[length > _POINT * part.diagonal]
    return {
        "name": mark.name,
        "role": ROLES[mark.role],
        "colour": COLOURS[mark.role],
        "volume": mark.role == "unjudged" or _region_name(mark) not in part.regions,
        "mesh": packed_corners(mark.corners),
        "hatch": quantised(strokes.reshape(-1, 3)),
        "at": plain_vector(anchor_point(mark.corners)),
    }


def _action_data(drawn: DrawnAction) -> dict[str, Any]:
    return {
        "text": drawn.action.text,
        "at": plain_vector(drawn.label),
        "arrows": [[plain_vector(a.tail), plain_vector(a.tip)] for a in drawn.arrows],
        "bars": [
            {"radius": bars.radius, "segments": np.asarray(bars.segments).round(6).tolist()}
            for bars in drawn.lines
        ],
    }


def _case_facts(case: Mapping[str, Any], size: float) -> Iterator[tuple[str, str]]:
    """Supports and loads of a load case, and their resultant, on a part of a size, mm."""
    for support in case["supports"]:
        moved = support["displacement_mm"]
        held = "".join(axis for axis, value in zip("xyz", moved, strict=True) if value == 0)
        words = [f"held in {', '.join(held)}"] if held else []
        words += [
            f"moved by {value:g} mm in {axis}"
            for axis, value in zip("xyz", moved, strict=True)
            if value
        ]
        words += ["plane of symmetry"] if support["symmetry"] else []
        yield f"support {support['region']}", ", ".join(words)
    for load in case["loads"]:
        yield f"load {load['on']}", f"force {_vector(load['force_N'])} N"
    force, moment = case["force_N"], case["moment_N_mm"]
    arm = size * float(np.linalg.norm(force))
    about = f"about the held regions' centre, {_vector(case['about_mm'], size)} mm"
    yield "resultant", f"{np.linalg.norm(force):.4g} N, {_vector(force)} N"
    yield "moment", f"{_vector(moment, arm)} N mm {about}"
    if case["temperature_change_K"]:
        yield "temperature", f"change of {case['temperature_change_K']:+g} K"
    if case["cancels"]:
        yield "sum", "the loads cancel: nothing is left to the supports"


def _vector(values: Sequence[float], size: float = 0.0) -> str:
    """Figures without what is rounding noise beside the largest of them, and beside a size."""
    largest = max(size, *map(abs, values))
    return f"({', '.join(f'{0.0 if abs(v) < _NO_FORCE * largest else v:.4g}' for v in values)})"


def _line_of_action(part: Part, case: Mapping[str, Any]) -> list[list[float]] | None:
    """Both ends of the line on which the resultant of a load case acts, beyond the part's box.

    Of a force F with a moment M about a point, the line through that point plus F x M / F^2: there
    the moment is along the force. None where no force is left.
    """
    force, moment = np.array(case["force_N"]), np.array(case["moment_N_mm"])
    size = float(np.linalg.norm(force))
    if case["cancels"] or size * part.diagonal <= _NO_FORCE * float(np.linalg.norm(moment)):
        return None
    unit = force / size
    through = np.array(case["about_mm"]) + np.cross(force, moment) / size**2
    box = corner_points(part.surface).reshape(-1, 3)
    along = (box - through) @ unit
    reach = _BEYOND * part.diagonal
    ends = [through + unit * (along.min() - reach), through + unit * (along.max() + reach)]
    return [plain_vector(end) for end in ends]
