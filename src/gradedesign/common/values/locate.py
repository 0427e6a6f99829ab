"""Place in the case file of a key, for messages, and of what caused an error detected later."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from gradedesign.common.values.problems import is_key
from gradedesign.common.values.table import Table
from gradedesign.errors import GradeDesignError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Where:
    """Where the keys of a case stand: calling it with a dotted key names file, line and key."""

    file: str  #: Name of the case file.
    #: Line of every key of the file, by dotted path such as ``load_case[0].load[1].force``.
    lines: Mapping[str, int] = field(default_factory=dict)
    #: Keys of the file that stand for others: a zone's for those of ``[lattice]``.
    aliases: Mapping[str, str] = field(default_factory=dict)
    layout: type[Table] = Table  #: Layout of the file, which tells what is a key.

    def __call__(self, key: str) -> str:
        """Name file and line of a dotted key such as ``region.tip`` or ``load_case[0].fix[0]``.

        Returns str: ``case.toml:12: region.tip``, with the line of the nearest table around a key
        that is not written; without one where none is.
        """
        key = self.aliases.get(key, key)
        around = key
        while around and around not in self.lines:
            around = around[: max(around.rfind("."), around.rfind("["), 0)]
        line = self.lines.get(around)
        place = self.file if line is None else f"{self.file}:{line}"
        return f"{place}: {key}"


@contextmanager
def locating(where: Where, key: str) -> Iterator[None]:
    """Put file, line and key before the message of every error raised inside.

    Raises `GradeDesignError` of the class that was raised inside.

    ``key``: dotted key that asked for what is done inside. An error whose message starts with a key
    of a case file, such as ``region.tip: ...``, keeps its own; one that has its place already stays
    as it is.
    """
    try:
        yield
    except GradeDesignError as error:
        if str(error).startswith((f"{where.file}: ", f"{where.file}:")):
            raise
        first, colon, rest = str(error).partition(": ")
        if colon and (first in where.lines or is_key(where.layout, first)):
            raise type(error)(f"{where(first)}: {rest}") from error
        raise type(error)(f"{where(key)}: {error}") from error
