"""``gradedesign new``: from the file of a part to a case file, with its faces as regions."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from gradedesign.common.system.atomic import replacing_path, write_text
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.check.draft_case import DraftCase, draft_case, draft_text, open_questions
from gradedesign.errors import CaseError
from gradedesign.geometry.part.file_faces import file_body_words
from gradedesign.geometry.part.part_schema import BODIES, UNITS
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_table, print_text, print_warnings
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
    strict_plugins: bool,
) -> None:
    """Read a part, propose regions, and write a case file beside a copy of it."""
    name = re.sub(r"[^\w.-]+", "-", file.stem).strip("-.") or "part"
    folder = Path(name) if output is None else output
    case_file = folder / _CASE_FILE
    for path in (case_file, folder / PICTURE):
        if path.exists():
            raise CaseError(f"{path} is there already; choose another folder with -o")
    if units is not None and units not in UNITS:
        raise CaseError(f"--units: found {shown(units)}; {instead(units, UNITS)}")
    if repair not in ("safe", "auto"):
        raise CaseError(f"--repair: found {shown(repair)}; {instead(repair, ('safe', 'auto'))}")
    if bodies not in BODIES:
        raise CaseError(f"--bodies: found {shown(bodies)}; {instead(bodies, BODIES)}")
    registry = registry_for(strict_plugins=strict_plugins)
    with ProgressLines("new", err=True):
        draft = draft_case(file, registry, units=units, auto=repair == "auto", bodies=bodies)
        beside = _copied(file, folder)
        drawn = _draw(draft, folder / PICTURE, name)
        text = draft_text(draft, file.stem, beside.name)
        write_text(case_file, text)
    part = draft.part
    for line in (part_words(part), *file_body_words(part.file_bodies), repair_words(part)):
        print_text(line, hang=2)
    print_regions(part, draft.regions)
    print_holes(part, draft.others)
    print_file_faces(part)
    print_text(f"picture: {folder / PICTURE}", hang=2)
    print_text(f"case: {case_file}", hang=2)
    print_table(
        'Left to state there, each as "?"',
        ("line", "key", "what to write"),
        [(str(asked.line), asked.key, asked.expected) for asked in open_questions(text)],
    )
    print_text(f"Then: gradedesign check {folder}", hang=2)
    print_warnings((*part.report.warnings, *drawn))


def _copied(file: Path, folder: Path) -> Path:
    """The part's file in the folder; copied where it lies elsewhere."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError(f"cannot make {folder}: {error.strerror}; choose another with -o") from None
    beside = folder / file.name
    if beside.exists():
        if not beside.samefile(file):
            raise CaseError(f"{beside} is another file; choose another folder with -o")
        return beside
    with replacing_path(beside) as path:
        shutil.copyfile(file, path)
    return beside


def _draw(draft: DraftCase, path: Path, name: str) -> tuple[str, ...]:
    """Draw the part with the proposed regions; returns warnings."""
    corners = draft.part.surface.vertices[draft.part.surface.faces]
    marks = [
        RegionMark(name=key, role="region", corners=corners[region.triangles])
        for key, region in draft.regions.items()
    ]
    return picture_loads(path, draft.part.surface, marks, title=f"Regions of {name}")
