"""``gradedesign new``: from the file of a part to a case file, with its faces as regions."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gradedesign.common.system.atomic import replacing_path, write_text
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.check.draft_case import DraftCase, draft_case, draft_text, open_questions
from gradedesign.errors import CaseError
from gradedesign.geometry.part.file_faces import file_body_words
from gradedesign.geometry.part.part_schema import BODIES, UNITS
from gradedesign.program.commands.check_data import hole_data, part_data, region_data
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_json, print_table, print_text, print_warnings
from gradedesign.program.commands.show_part import (
    part_words,
    print_file_faces,
    print_holes,
    print_regions,
    repair_words,
)
from gradedesign.program.pictures.pictures import picture_loads
from gradedesign.program.pictures.region_mark import RegionMark

_CASE_FILE = "case.toml"
PICTURE = "regions.png"


def new(
    file: Path,
    output: Path | None,
    *,
    units: str | None,
    repair: str,
    bodies: str,
    dry_run: bool,
    strict_plugins: bool,
    as_json: bool,
) -> None:
    """Read a part and propose regions; write a case file beside a copy of it, unless a dry run."""
    name = re.sub(r"[^\w.-]+", "-", file.stem).strip("-.") or "part"
    folder = Path(name) if output is None else output
    case_file = folder / _CASE_FILE
    for path in () if dry_run else (case_file, folder / PICTURE):
        if path.exists():
            raise CaseError(f"{path} is there already; choose another folder with -o")
    if units is not None and units not in UNITS:
        raise CaseError(f"--units: found {shown(units)}; {instead(units, UNITS)}")
    if repair not in ("safe", "auto"):
        raise CaseError(f"--repair: found {shown(repair)}; {instead(repair, ('safe', 'auto'))}")
    if bodies not in BODIES:
        raise CaseError(f"--bodies: found {shown(bodies)}; {instead(bodies, BODIES)}")
    registry = registry_for(strict_plugins=strict_plugins)
    drawn: tuple[str, ...] = ()
    with ProgressLines("new", err=True):
        draft = draft_case(file, registry, units=units, auto=repair == "auto", bodies=bodies)
        if not dry_run:
            _copy(file, folder)
            drawn = _draw(draft, folder / PICTURE, name)
        text = draft_text(draft, file.stem, file.name)
        if not dry_run:
            write_text(case_file, text)
    warnings = (*draft.part.report.warnings, *drawn)
    written = None if dry_run else folder
    if as_json:
        print_json(_draft_data(draft, text, written, warnings))
        return
    _print_draft(draft, text, written)
    print_warnings(warnings)


def _print_draft(draft: DraftCase, text: str, written: Path | None) -> None:
    """Print a part and its case for a person; ``written``: their folder."""
    part = draft.part
    for line in (part_words(part), *file_body_words(part.file_bodies), repair_words(part)):
        print_text(line, hang=2)
    print_regions(part, draft.regions)
    print_holes(part, draft.others)
    print_file_faces(part)
    if written is None:
        return
    print_text(f"picture: {written / PICTURE}", hang=2)
    print_text(f"case: {written / _CASE_FILE}", hang=2)
    print_table(
        'Left to state there, each as "?"',
        ("line", "key", "what to write"),
        [(str(asked.line), asked.key, asked.expected) for asked in open_questions(text)],
    )
    print_text(f"Then: gradedesign check {written}", hang=2)


def _draft_data(
    draft: DraftCase, text: str, written: Path | None, warnings: Sequence[str]
) -> dict[str, Any]:
    """Plain data of a part and its case; lengths in mm."""
    return {
        "part": part_data(draft.part, None),
        "regions": [
            {**region, "lines": draft.lines[region["name"]]}
            for region in region_data(draft.regions)
        ],
        "holes": hole_data(draft.others),
        "case": None if written is None else str(written / _CASE_FILE),
        "picture": None if written is None else str(written / PICTURE),
        "text": text,
        "open_questions": [asdict(asked) for asked in open_questions(text)],
        "warnings": list(warnings),
    }


def _copy(file: Path, folder: Path) -> None:
    """Copy the part's file into the folder, unless it lies there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(f"cannot make {folder}: {error.strerror}; choose another with -o") from None
    beside = folder / file.name
    if beside.exists():
        if not beside.samefile(file):
            raise CaseError(f"{beside} is another file; choose another folder with -o")
        return
    with replacing_path(beside) as path:
        shutil.copyfile(file, path)


def _draw(draft: DraftCase, path: Path, name: str) -> tuple[str, ...]:
    """Draw the part with the proposed regions; returns warnings."""
    corners = draft.part.surface.vertices[draft.part.surface.faces]
    marks = [
        RegionMark(name=key, role="region", corners=corners[region.triangles])
        for key, region in draft.regions.items()
    ]
    return picture_loads(path, draft.part.surface, marks, title=f"Regions of {name}")
