"""Folders of a suite: a case beside the values that are expected of it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradedesign import CaseError, GradeDesignError, load_case
from gradedesign.commands import Registry, content_key, is_folder
from gradedesign_validate.expected_values import read_expected


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteCase:
    """A case folder with what a line of the history says of it before it runs.

    ``memory``: that it states, bytes.
    """

    folder: Path
    expected: Mapping[str, Mapping[str, Any]]
    case_hash: str
    text_key: str
    program_key: str
    memory: int

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name

    @property
    def cause(self) -> tuple[str, str, str]:
        """As `HistoryLine.cause`."""
        return self.case_hash, self.text_key, self.program_key


def suite_case(folder: Path, registry: Registry, program_key: str) -> SuiteCase:
    """Read a case folder; one whose case is damaged has no hash, and its run tells why."""
    texts = [(folder / name).read_bytes() for name in ("case.toml", "expected.toml")]
    try:
        case = load_case(folder / "case.toml", registry=registry)
        case_hash, memory = case.case_hash, case.run.memory
    except GradeDesignError:
        case_hash, memory = "", 0
    return SuiteCase(
        folder=folder,
        expected=read_expected(folder / "expected.toml"),
        case_hash=case_hash,
        text_key=content_key(*texts),
        program_key=program_key,
        memory=memory,
    )


def case_folders(folders: Sequence[Path], keyword: str) -> list[Path]:
    """Folders that hold a case and its expectations, themselves or else anywhere below.

    A folder that is named and holds a case is that case alone, as each process of a suite needs it.
    What stands in folders with a leading dot does not count. Raises CaseError if none matches, and
    if two have one name.
    """
    candidates: dict[Path, Path] = {}
    for folder in folders:
        below = sorted(folder.rglob("expected.toml")) if is_folder(folder) else []
        own = folder / "expected.toml"
        for found in (path.parent for path in ([own] if own in below else below)):
            hidden = any(part.startswith(".") for part in found.relative_to(folder).parts)
            if (found / "case.toml").is_file() and not hidden:
                candidates.setdefault(found.resolve(), found)
    chosen = {place: f for place, f in candidates.items() if matches(place.name, keyword)}
    if not chosen:
        names = ", ".join(f.name for f in candidates.values()) or "none"
        raise CaseError(
            f"no case folder matches '{keyword}' in {', '.join(map(str, folders))}; a case folder "
            f"holds case.toml and expected.toml; found: {names}"
        )
    names_of: dict[str, Path] = {}
    for place, folder in chosen.items():
        other = names_of.setdefault(place.name, folder)
        if other is not folder:
            raise CaseError(
                f"{other} and {folder} have one name, by which tables and the history tell cases "
                f"apart; rename one, or validate them one after the other"
            )
    return list(chosen.values())


def matches(name: str, expression: str) -> bool:
    """Words joined by ``or`` and ``and``, each may be negated by ``not``."""
    if not expression.strip():
        return True
    return any(
        all(
            (term.removeprefix("not ").strip() not in name)
            if term.startswith("not ")
            else (term in name)
            for term in (t.strip() for t in re.split(r"\band\b", group))
        )
        for group in re.split(r"\bor\b", expression)
    )
