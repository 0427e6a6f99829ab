"""Place in the case file that caused an error detected later."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from gradedesign.case.problems import is_key
from gradedesign.case.schema import CaseIdentity
from gradedesign.errors import GradeDesignError


@contextmanager
def locating(case: CaseIdentity, key: str) -> Iterator[None]:
    """Put file, line and key before the message of every error raised inside.

    Parameters
    ----------
    case : CaseIdentity
    key : str
        Dotted key that asked for what is done inside. An error whose message starts with a key
        of a case file, such as ``region.tip: ...``, keeps its own; one that has its place already
        stays as it is.

    Raises
    ------
    GradeDesignError
        Of the class that was raised inside.
    """
    try:
        yield
    except GradeDesignError as error:
        if str(error).startswith((f"{case.path.name}: ", f"{case.path.name}:")):
            raise
        first, colon, rest = str(error).partition(": ")
        if colon and (first in case.lines or is_key(type(case), first)):
            raise type(error)(f"{case.where(first)}: {rest}") from error
        raise type(error)(f"{case.where(key)}: {error}") from error
