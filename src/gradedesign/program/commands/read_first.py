"""A look at the text of a case before its command is loaded: a mistake in it costs no loading."""

from __future__ import annotations

from pathlib import Path


def require_case_text(path: Path, *, allow_outside: bool) -> None:
    """Refuse a case of ``check`` or ``run`` for what its text alone shows.

    Raises
    ------
    CaseError
        With every problem.
    """
    from gradedesign.design.case.checks import cross_problems
    from gradedesign.design.case.read_case import require_text
    from gradedesign.design.case.schema import CaseFile

    require_text(path, CaseFile, cross_problems, allow_outside=allow_outside)


def require_generate_text(path: Path, *, allow_outside: bool) -> None:
    """Refuse a case of ``generate`` for what its text alone shows.

    Raises
    ------
    CaseError
        With every problem.
    """
    from gradedesign.design.case.generate_schema import GenerateFile
    from gradedesign.design.case.read_case import require_text
    from gradedesign.design.case.read_generate import generate_problems

    require_text(path, GenerateFile, generate_problems, allow_outside=allow_outside)
