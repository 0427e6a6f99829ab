"""The commands: the only place that prints, catches broadly or exits.

Door: `main`.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from typing import NoReturn

from gradedesign.errors import Interrupted
from gradedesign.program.commands.interrupt import interruptible

__all__ = ["main"]

#: Exit code of shells for a command that ended by SIGINT: 128 + 2.
_INTERRUPTED = 130
#: How an interrupted command goes on.
_RESUMABLE = {"run": "go on with the same command and --resume"}


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; SIGINT and SIGTERM end it with 130 and one line.

    ``arguments``: those of the process by default.
    """
    # The interpreter would look through every object for cycles as it ends: 0.7 of the 0.9 s of
    # processor time between the last line of a command and its end, tens of seconds on a machine
    # that is busy with more. Nothing is freed by it that the end of the process does not free.
    atexit.register(gc.freeze)
    words = list(sys.argv[1:] if arguments is None else arguments)
    with interruptible() as interruption:
        try:
            # The commands take a second to import, in which a signal is to be heard already.
            from gradedesign.program.commands.app import run_command

            run_command(words, interruption)
        except Interrupted as error:
            command = next((word for word in words if not word.startswith("-")), "")
            resumable = str(error) or _RESUMABLE.get(command, "")
            sys.stderr.write("; ".join(filter(None, ("interrupted", resumable))) + "\n")
            sys.exit(_INTERRUPTED)
