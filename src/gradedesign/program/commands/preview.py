"""``gradedesign preview``: the part of a case in the browser, before any run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradedesign.common.system.atomic import write_text
from gradedesign.common.values.locate import Where
from gradedesign.design.case.read_case import case_file, part_files, read_toml
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.shown_case import CaseShown, part_alone, shown_case
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.serve_page import serve_page
from gradedesign.program.commands.show import print_text
from gradedesign.program.commands.show_part import part_words
from gradedesign.program.host.read_case import load_case
from gradedesign.program.outputs.files import RESULT_NAME
from gradedesign.program.outputs.finished import stored_result
from gradedesign.program.outputs.scene_file import stored_scene, stored_still
from gradedesign.program.pictures.case_scene import case_scene, case_still
from gradedesign.program.pictures.page import Problem, scene_page
from gradedesign.program.store.manifest import read_manifest

#: Lines of the case that are shown before and after a mistake. Chosen, not measured.
_AROUND = 2
#: A place on the part, as messages name it.
_PLACE = re.compile(r"\((-?[\d.e+-]+), (-?[\d.e+-]+), (-?[\d.e+-]+)\) mm")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Preview:
    """A case as far as it can be shown."""

    shown: CaseShown | None  #: None where not even its part can be read.
    title: str
    problem: Problem | None  #: What is wrong with it.
    read: tuple[Path, ...]  #: Files that it was read from.

    def page(self, watch: str = "") -> str:
        """The page; a served one asks whether ``watch`` still holds, and loads again if not."""
        data: dict[str, Any] = {"title": self.title, "watch": watch}
        if self.shown is not None:
            data |= case_scene(self.shown, self.title)
        if self.problem is not None:
            data["places"] = [list(map(float, at)) for at in _PLACE.findall(self.problem.message)]
        return scene_page(data, self.still, words=[self.words], problem=self.problem)

    @property
    def still(self) -> bytes | None:
        """PNG of the loading; None without a part."""
        return None if self.shown is None else case_still(self.shown, f"Loading of {self.title}")

    @property
    def words(self) -> str:
        """The line below the title."""
        if self.shown is None:
            return "its part cannot be shown yet"
        words, material = part_words(self.shown.part), self.shown.material
        if material is not None:
            mass = material.density * self.shown.part.volume * 1e6
            words += f", {mass:.4g} g if solid in {material.name}"
        return (
            words
            if not self.shown.balances or self.problem
            else f"{words}; no rigid motion is left free"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunPreview:
    """A finished run."""

    scene: Mapping[str, Any]
    words: str  #: The verdict.
    still: bytes | None  #: PNG of the printed body, or of what the run came to.
    read: tuple[Path, ...]

    problem: Problem | None = None

    def page(self, watch: str = "") -> str:
        """The page, as of a case."""
        return scene_page({**self.scene, "watch": watch}, self.still, words=[self.words])


def run_preview(folder: Path) -> RunPreview:
    """The scene that a run has left in its folder.

    Raises CaseError if it has left none.
    """
    result, scene = stored_result(folder), stored_scene(folder)
    return RunPreview(
        scene=scene,
        words=result.verdict,
        still=stored_still(result),
        read=(folder / RESULT_NAME,),
    )


def case_preview(path: Path, registry: Registry, *, allow_outside: bool) -> Preview:
    """Read a case as far as it goes: its loads, else its regions, else its part alone.

    Raises CaseError if there is no such file.
    """
    file = case_file(path)
    title = file.parent.name or file.stem
    read: tuple[Path, ...] = (file,)
    shown: CaseShown | None = None
    try:
        case = load_case(file, allow_outside=allow_outside, registry=registry)
        title, read = case.name, (file, *part_files(case.part))
        shown = shown_case(case, registry)
        mistake = shown.mistake
    except GradeDesignError as error:
        mistake = error
        with suppress(GradeDesignError):  # told already
            context = {"folder": file.parent, "allow_outside": allow_outside}
            alone = part_alone(read_toml(file)[0], context, registry, Where(file=file.name))
            if alone is not None:
                read, shown = (file, *part_files(alone[0])), CaseShown(part=alone[1])
    problem = None if mistake is None else problem_at(file, mistake)
    return Preview(shown=shown, title=title, problem=problem, read=read)


def problem_at(file: Path, error: GradeDesignError) -> Problem:
    """An error with the lines of the case that it names."""
    named = {int(n) for n in re.findall(rf"{re.escape(file.name)}:(\d+)", str(error))}
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    near = sorted({k for n in named for k in range(n - _AROUND, n + _AROUND + 1)})
    rows = [(k, lines[k - 1], k in named) for k in near if 0 < k <= len(lines)]
    is_open = any('"?' in row for _, row, there in rows if there)
    return Problem(message=str(error), rows=rows, is_open=is_open)


def preview(
    path: Path,
    output: Path | None,
    *,
    port: int | None,
    watch: bool,
    allow_outside: bool,
    strict_plugins: bool,
) -> None:
    """Write the page of a case or of a run, or serve it until the command is interrupted.

    Raises CaseError if there is no case, a page that is written is to be served too, or the port is
    taken.
    """
    if output is not None and (watch or port is not None):
        raise CaseError(
            "--output writes the page once; leave it out to serve the page, or leave out --watch "
            "and --port"
        )
    of_run = path.is_dir() and read_manifest(path) is not None
    registry = None if of_run else registry_for(strict_plugins=strict_plugins)

    def make() -> Preview | RunPreview:
        if registry is None:
            return run_preview(path)
        with ProgressLines("preview", err=True):
            shown = case_preview(path, registry, allow_outside=allow_outside)
        if shown.problem is not None:
            for line in f"mistake: {shown.problem.message}".splitlines():
                print_text(line, hang=2)
        return shown

    if output is None:
        serve_page(make, port=port or 0, watch=watch, on_start=_tell_address)
        return
    page = make().page()
    write_text(output, page)
    print_text(f"page: {output}, {len(page) / 1e6:.2g} MB", hang=2)


def _tell_address(address: str) -> None:
    print_text(f"page: {address} (Ctrl-C ends it)", hang=2)
