"""``gradedesign new``: from the file of a part to a case file, with its faces as regions."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gradedesign.common.system.atomic import replacing_path, write_text
from gradedesign.common.system.scratch import scratch_folder
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.case.schema import Case
from gradedesign.design.check.check_case import CaseCheck, check_case
from gradedesign.design.check.draft_case import DraftCase, UnitError, draft_case
from gradedesign.design.check.draft_text import (
    draft_text,
    is_whole,
    open_questions,
)
from gradedesign.design.check.proposals import Proposal
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import UNMET, CaseError, Interrupted
from gradedesign.geometry.part.file_faces import file_body_words
from gradedesign.geometry.part.part_schema import BODIES, UNITS
from gradedesign.program.commands.answers import OPTIONS, needed, read_answers
from gradedesign.program.commands.ask import ask_answers, ask_line, on_terminal
from gradedesign.program.commands.check import estimated, print_outlook
from gradedesign.program.commands.check_data import hole_data, part_data, region_data
from gradedesign.program.commands.layout import say, wrapped
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_json, print_table, print_text, print_warnings
from gradedesign.program.commands.show_answer import answer_data, print_answer
from gradedesign.program.commands.show_part import (
    part_words,
    print_file_faces,
    print_holes,
    print_regions,
    repair_words,
)
from gradedesign.program.host.read_case import load_case
from gradedesign.program.pictures.pictures import picture_loads
from gradedesign.program.pictures.region_mark import RegionMark

_CASE_FILE = "case.toml"
PICTURE = "regions.png"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Written:
    """The text of a case; its check where nothing is open."""

    text: str
    case: Case | None = None
    checked: CaseCheck | None = None


def new(
    file: Path,
    output: Path | None,
    *,
    units: str | None,
    repair: str,
    bodies: str,
    typed: Mapping[str, Sequence[str]],
    ask: bool,
    estimate: bool,
    dry_run: bool,
    strict_plugins: bool,
    as_json: bool,
) -> int:
    """Read a part and propose regions; write a case file beside a copy of it, unless a dry run.

    Returns the exit code: that of a check with an estimate where there is one.

    ``typed``: answers by key of the case. ``ask``: whether to ask where there is none, if somebody
    is at a terminal.
    """
    name = re.sub(r"[^\w.-]+", "-", file.stem).strip("-.") or "part"
    folder = Path(name) if output is None else output
    for path in () if dry_run else (folder / _CASE_FILE, folder / PICTURE):
        if path.exists():
            raise CaseError(f"{path} is there already; choose another folder with -o")
    asks = ask and on_terminal() and not (dry_run or as_json or any(typed.values()))
    registry = registry_for(strict_plugins=strict_plugins)
    draft = _read(file, registry, units, repair, bodies, asks=asks)
    answers = read_answers(typed, draft, registry)
    if estimate and not asks and not is_whole(answers):
        raise CaseError(f"--estimate goes with all of {needed()}; leave it out, or add the others")
    written = _with_answers(draft, file, answers, registry)
    drawn: tuple[str, ...] = ()
    if not dry_run:
        with ProgressLines("new", err=True):
            _copy(file, folder)
            drawn = _draw(draft, folder / PICTURE, name)
        write_text(folder / _CASE_FILE, written.text)
    if not as_json:
        _print_part(draft, None if dry_run else folder)
    if asks:
        typed = _asked(draft, file, folder / _CASE_FILE, registry)
        written = _with_answers(draft, file, read_answers(typed, draft, registry), registry)
        write_text(folder / _CASE_FILE, written.text)
    warnings = list(draft.part.report.warnings) + list(drawn)
    if (checked := written.checked) is not None:
        warnings += checked.warnings
        if not as_json:
            print_outlook(checked)
            print_warnings(dict.fromkeys(warnings))
        estimate = estimate or (asks and _wants_estimate())
    answer = None
    if estimate and written.case is not None and checked is not None:
        with ProgressLines("estimate", err=True):
            answer = estimated(written.case, checked, registry)
    place = None if dry_run else folder
    if as_json:
        data = _draft_data(draft, written.text, place, tuple(dict.fromkeys(warnings)))
        print_json(data if answer is None else {**data, "first_answer": answer_data(answer)})
    else:
        if answer is not None:
            print_answer(answer)
        elif checked is None:
            print_warnings(warnings)
        if asks:
            _print_command(file, output, draft, typed)
        _print_next(written, place)
    return 0 if answer is None or answer.feasible else UNMET


def _read(
    file: Path,
    registry: Registry,
    units: str | None,
    repair: str,
    bodies: str,
    *,
    asks: bool,
) -> DraftCase:
    """The part with its regions; its unit is asked for where it is not known."""
    if units is not None and units not in UNITS:
        raise CaseError(f"--units: found {shown(units)}; {instead(units, UNITS)}")
    if repair not in ("safe", "auto"):
        raise CaseError(f"--repair: found {shown(repair)}; {instead(repair, ('safe', 'auto'))}")
    if bodies not in BODIES:
        raise CaseError(f"--bodies: found {shown(bodies)}; {instead(bodies, BODIES)}")
    while True:
        try:
            with ProgressLines("new", err=True):
                return draft_case(file, registry, units=units, auto=repair == "auto", bodies=bodies)
        except UnitError as error:
            if not asks:
                raise
            words = f"{error.box}. Which unit: {', '.join(UNITS)}?"
            proposal = Proposal(name=error.unit, why=error.why)
        while (units := ask_line(words, proposal)) not in UNITS:
            print_text(f"found {shown(units)}; {instead(units, UNITS)}", hang=2)


def _asked(
    draft: DraftCase, file: Path, case_file: Path, registry: Registry
) -> dict[str, list[str]]:
    """Texts that somebody typed, by key; the case file has every answer at once.

    Raises Interrupted, with what is there then.
    """

    def write(answers: Mapping[str, Any]) -> None:
        write_text(case_file, draft_text(draft, file.stem, file.name, answers))

    try:
        return ask_answers(draft, registry, write)
    except Interrupted:
        raise Interrupted(f"{case_file} holds what was answered") from None


def _with_answers(
    draft: DraftCase, file: Path, answers: Mapping[str, Any], registry: Registry
) -> _Written:
    """The text of a case with these answers, checked where nothing is open.

    Raises GradeDesignError as a check; the case that it speaks of is not written yet.
    """
    text = draft_text(draft, file.stem, file.name, answers)
    if not is_whole(answers):
        return _Written(text=text)
    with ProgressLines("check", err=True), scratch_folder("new") as scratch:
        (scratch / _CASE_FILE).write_text(text, encoding="utf-8")
        part = {"part.file": str(file.absolute())}
        try:
            case = load_case(scratch, allow_outside=True, registry=registry, values=part)
            checked = check_case(case, registry)
        except CaseError as error:
            raise CaseError(str(error).replace(f"{scratch}/", "")) from None
    text = draft_text(draft, file.stem, file.name, answers, checked)
    return _Written(text=text, case=case, checked=checked)


def _wants_estimate() -> bool:
    """Whether the masses of other bodies are to be predicted now."""
    words = "Predict now what five bodies would weigh at these limits? y or n"
    why = "yes: the solid part is analysed and each body sized once, in minutes; Ctrl-C ends it"
    try:
        while (line := ask_line(words, Proposal(name="", why=why)).lower()) not in ("", "y", "yes"):
            if line in ("n", "no"):
                return False
    except EOFError:
        return False
    return True


def _print_part(draft: DraftCase, written: Path | None) -> None:
    """Print a part and what was found on it."""
    part = draft.part
    for line in (part_words(part), *file_body_words(part.file_bodies), repair_words(part)):
        print_text(line, hang=2)
    print_regions(part, draft.regions, draft.shapes)
    print_holes(part, draft.others)
    print_file_faces(part)
    if written is not None:
        print_text(f"picture: {written / PICTURE}", hang=2)
        print_text(f"case: {written / _CASE_FILE}", hang=2)


def _print_next(written: _Written, place: Path | None) -> None:
    """Print what is open in a written case, or what comes next."""
    if place is None:
        return
    if written.checked is not None:
        print_text(f"Next: gradedesign preview {place}, gradedesign run {place}", hang=2)
        return
    print_table(
        'Left to state there, each as "?"',
        ("line", "key", "what to write"),
        [(str(asked.line), asked.key, asked.expected) for asked in open_questions(written.text)],
    )
    print_text(f"Then: gradedesign check {place}", hang=2)


def _print_command(
    file: Path, output: Path | None, draft: DraftCase, typed: Mapping[str, Sequence[str]]
) -> None:
    """Print the command that writes the same case without a question."""
    words = ["gradedesign", "new", str(file), *(() if output is None else ("-o", str(output)))]
    pairs = [(f"--{key}", value) for key, value in draft.stated.items()]
    pairs += [(OPTIONS[key].name, text) for key, texts in typed.items() for text in texts]
    groups = [shlex.join(words), *(shlex.join(pair) for pair in pairs)]
    lines = wrapped(" ".join(group.replace(" ", "\0") for group in groups), width=78, hang=4)
    print_text("The same case by one command:")
    say(" \\\n".join(lines).replace("\0", " "))


def _draft_data(
    draft: DraftCase, text: str, written: Path | None, warnings: Sequence[str]
) -> dict[str, Any]:
    """Plain data of a part and its case; lengths in mm."""
    shapes = dict(zip(draft.shapes, hole_data(tuple(draft.shapes.values())), strict=True))
    return {
        "part": part_data(draft.part, None),
        "regions": [
            {
                **region,
                "lines": draft.lines[region["name"]],
                "shape": shapes.get(region["name"]),
            }
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
