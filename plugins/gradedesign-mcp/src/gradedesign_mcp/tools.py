"""Tools on parts and cases: each is a command of gradedesign on files of one folder."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import anyio
from mcp.server.mcpserver import Context, Image
from mcp.server.mcpserver.exceptions import ToolError
from pydantic import Field

from gradedesign.commands import write_text
from gradedesign_mcp.bounds import CASE_FILE, Bounds, name_of
from gradedesign_mcp.job import NOTE, POLL, report, start

#: Letters of a case and bytes of a picture. Chosen, not measured.
_MOST_LETTERS, _MOST_BYTES = 200_000, 8_000_000
#: Of each cell in the list of all; one that is named is told in full.
_BRIEF = ("name", "density_window", "source", "supplied_by")

_Part = Annotated[str, Field(description="File of the part, relative to the server's folder.")]
_Case = Annotated[
    str, Field(description="case.toml or its folder, relative to the server's folder.")
]
_Units = Annotated[
    str | None, Field(description="Unit of a file that carries none, such as mm or inch.")
]
_Repair = Annotated[
    Literal["safe", "auto"], Field(description="auto mends damage that needs a choice.")
]
_Bodies = Annotated[
    Literal["one", "join", "all"], Field(description="join unites solids that touch.")
]


@dataclass(slots=True, kw_only=True, eq=False)
class Tools:
    """Tools on parts and cases, and what is installed.

    Attributes
    ----------
    turn : anyio.Lock
        Of commands that are no runs: one after another.
    """

    bounds: Bounds
    turn: anyio.Lock = field(default_factory=anyio.Lock)

    async def inspect_part(
        self,
        ctx: Context,
        part: _Part,
        units: _Units = None,
        repair: _Repair = "safe",
        bodies: _Bodies = "one",
    ) -> dict[str, Any]:
        """Look at a part; writes nothing.

        Returns its size, volume and repairs, the regions that a case could name with the lines
        that select them, its holes and the faces of its file, and the text of a case for it.
        Lengths are in mm. The same as `gradedesign new PART --dry-run --json`.
        """
        file = self.bounds.inside(part, "part")
        return await self._answer(ctx, _new_words(file, units, repair, bodies, "--dry-run"))

    async def propose_case(
        self,
        ctx: Context,
        part: _Part,
        folder: Annotated[str, Field(description="New folder for the case.")],
        units: _Units = None,
        repair: _Repair = "safe",
        bodies: _Bodies = "one",
    ) -> dict[str, Any]:
        """Write a case for a part into a new folder, with a copy of the part and a picture.

        What only the user knows (material, supports, loads, safety factor, cell) stands as "?";
        `open_questions` lists it. Ask the user, then state it with `write_case`. Nothing that is
        there is overwritten. The same as `gradedesign new PART -o FOLDER --json`.
        """
        file = self.bounds.inside(part, "part")
        place = self.bounds.inside(folder, "folder")
        words = _new_words(file, units, repair, bodies, f"--output={place}")
        return await self._answer(ctx, words)

    def read_case(self, case: _Case) -> str:
        """The text of a case file (TOML)."""
        file = self.bounds.case(case)
        try:
            return file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ToolError(f"case: {case!r} cannot be read ({error})") from None

    def write_case(
        self,
        folder: Annotated[str, Field(description="Folder, which must be there.")],
        text: Annotated[str, Field(description="The whole case file (TOML).")],
    ) -> str:
        """Write the file case.toml of a folder anew; `check_case` tells whether it is right.

        A case is data: it names a part and other files of its own folder, and holds no code.
        """
        place = self.bounds.inside(folder, "folder")
        file = self.bounds.inside(f"{folder}/{CASE_FILE}", "folder")
        if not place.is_dir():
            raise ToolError(f"folder: there is no {folder!r}; propose_case makes one for a part")
        if len(text) > _MOST_LETTERS:
            raise ToolError(f"text: {len(text)} letters; a case has at most {_MOST_LETTERS}")
        try:
            tables = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ToolError(f"text: no TOML ({error}); the case was left as it is") from None
        if "case" not in tables:
            raise ToolError("text: no table [case]; the case was left as it is")
        write_text(file, text)
        return f"written: {self.bounds.told(str(file))}"

    async def check_case(self, ctx: Context, case: _Case) -> dict[str, Any]:
        """Read a case, find its regions and balance its loads, in seconds.

        Returns regions, holes, loads, limits, the cell and its window, what a run would take in
        memory and time, a picture of loads and supports, and warnings; a mistake names its line and
        key. The same as `gradedesign check CASE --json`.
        """
        return await self._answer(ctx, self._check_words(case))

    async def estimate_masses(self, ctx: Context, case: _Case) -> dict[str, Any]:
        """Check a case and estimate what the part would weigh, in minutes at most.

        Under `first_answer`: as modelled, with cells of one density, of graded density, with
        lattice and solid, and with solid and void, and whether the solid part meets the limits. The
        same as `gradedesign check CASE --estimate --json`.
        """
        return await self._answer(ctx, [*self._check_words(case), "--estimate"])

    async def judge_body(
        self,
        ctx: Context,
        case: _Case,
        body: Annotated[
            str, Field(description="File of a closed body, such as STL, in the part's place.")
        ],
        units: _Units = None,
    ) -> dict[str, Any]:
        """Judge a body made elsewhere by the loads, supports and limits of a case, in minutes.

        Nothing is designed or written. Returns what `read_verdict` does, without files; `status` is
        met or not_met. The same as `gradedesign judge CASE BODY --json`.
        """
        path, file = self.bounds.case(case), self.bounds.inside(body, "body")
        words = ["judge", str(path), str(file), "--json"]
        return await self._answer(ctx, [*words, *_unit_words(units)])

    async def show_scene(
        self,
        ctx: Context,
        what: Annotated[
            str, Field(description="A case, its folder or a run folder; below the server's folder.")
        ],
    ) -> dict[str, Any]:
        """Write the page that shows a case or a finished run in the browser, and tell its path.

        The part turns, is cut open and shows fields and loads; a click tells what selects a face.
        The same as `gradedesign preview WHAT -o PAGE`.
        """
        path = self.bounds.inside(what, "what")
        of_run = path.is_dir() and not (path / CASE_FILE).exists()
        name = f"{name_of(path)}-scene.html" if of_run else f"{name_of(path)}-check/scene.html"
        page = self.bounds.inside(f"runs/{name}", "page")
        page.parent.mkdir(parents=True, exist_ok=True)
        words = await self._ended(ctx, ["preview", str(path), f"--output={page}"])
        return {"page": self.bounds.told(str(page)), "words": self.bounds.told(words).strip()}

    def show_picture(
        self, file: Annotated[str, Field(description="A PNG file that another tool names.")]
    ) -> Image:
        """Show a picture: loads and supports of a check, lattice and stress of a run."""
        path = self.bounds.inside(file, "file")
        try:
            size, data = path.stat().st_size, b""
            if size <= _MOST_BYTES:
                data = path.read_bytes()
        except OSError as error:
            raise ToolError(f"file: {file!r} cannot be read ({error.strerror})") from None
        if size > _MOST_BYTES:
            raise ToolError(f"file: {file!r} has {size} bytes; shown are {_MOST_BYTES} at most")
        if not data.startswith(b"\x89PNG"):
            raise ToolError(f"file: {file!r} is no PNG file; check_case and read_verdict name some")
        return Image(data=data, format="png")

    async def list_installed(
        self,
        ctx: Context,
        kind: Literal["cells", "materials", "processes"],
        name: Annotated[str | None, Field(description="One cell in full.")] = None,
    ) -> dict[str, Any]:
        """Cells, materials or printing processes that a case may name, with their sources."""
        if name is not None and kind != "cells":
            raise ToolError("name: only a cell is told in full; leave it out")
        words = [kind, "--json"] if name is None else [kind, "--json", "--", name]
        listed = json.loads(await self._ended(ctx, words))
        if name is None and kind == "cells":
            listed = [{key: cell[key] for key in _BRIEF} for cell in listed]
        return {kind: listed if isinstance(listed, list) else [listed]}

    async def _answer(self, ctx: Context, words: Sequence[str]) -> dict[str, Any]:
        """The plain data that a command prints."""
        return dict(self.bounds.told(json.loads(await self._ended(ctx, words))))

    async def _ended(self, ctx: Context, words: Sequence[str]) -> str:
        """Output of a command that is run to its end; a call that is cancelled ends it.

        Raises ToolError with its message if it fails.
        """
        async with self.turn:
            job = start(words)
            try:
                note = job.began + NOTE
                while job.code is None:
                    await anyio.sleep(POLL)
                    if time.monotonic() >= note:
                        note += NOTE
                        await report(ctx, job, job.last_line)
                if not job.answered:
                    raise ToolError(self.bounds.told(job.last_words))
                return job.output
            finally:
                job.close()

    def _check_words(self, case: str) -> list[str]:
        """Check a case; its picture lies in the server's folder too."""
        path = self.bounds.case(case)
        picture = self.bounds.inside(f"runs/{name_of(path)}-check/loads.png", "picture")
        return ["check", str(path), "--json", f"--output={picture}"]


def _new_words(file: Path, units: str | None, repair: str, bodies: str, where: str) -> list[str]:
    words = ["new", str(file), "--json", f"--repair={repair}", f"--bodies={bodies}", where]
    return [*words, *_unit_words(units)]


def _unit_words(units: str | None) -> list[str]:
    return [] if units is None else [f"--units={units}"]
