"""Every exception of gradedesign, each with the exit code of its family.

A message says what is wrong, the value with its unit, what was expected and what to try.
"""

from __future__ import annotations

import errno
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


#: Exit code of a result, not an error, that misses a limit: not met, or infeasible.
UNMET = 4


class Interrupted(BaseException):
    """The user or the system asked the command to end; typer would answer a `KeyboardInterrupt`."""


class GradeDesignError(Exception):
    """Base of every error that gradedesign raises on purpose."""

    exit_code = 70


class CaseError(GradeDesignError):
    """The case file or the command line asks for something impossible."""

    exit_code = 2


class PartError(GradeDesignError):
    """The geometry of the part is unusable."""

    exit_code = 3


class LatticeError(GradeDesignError):
    """The lattice cannot be built: it falls apart, is too thin or not closed."""

    exit_code = 3


class DisconnectedError(LatticeError):
    """A solid that falls apart on a grid.

    Attributes
    ----------
    share : float
        Of the volume, in disconnected components.
    """

    def __init__(self, message: str, *, share: float) -> None:
        super().__init__(message)
        self.share = share


class ResourceError(GradeDesignError):
    """Memory, time or disk is not enough."""

    exit_code = 5


class MeshError(GradeDesignError):
    """A mesher failed or returned a mesh that is refused."""

    exit_code = 6


class SolverError(GradeDesignError):
    """A linear solve failed its residual, balance or support checks."""

    exit_code = 6


class DensityError(GradeDesignError):
    """A density is outside the window in which it means anything, or sizing failed."""

    exit_code = 6


class PluginError(GradeDesignError):
    """A plugin failed to load, clashes with another, or broke its contract."""

    exit_code = 7


@contextmanager
def blaming(subject: str, *, always: bool = True) -> Iterator[None]:
    """Run code of a plugin; whatever it raises names the plugin.

    Parameters
    ----------
    subject : str
        Name of the code and its owner, such as ``cell 'acme-cube'``.
    always : bool
        Whether errors that the code raised on purpose name it too, or pass as they are.

    Raises
    ------
    GradeDesignError
        Of the class that the code raised on purpose.
    PluginError
        If it raised anything else, an attempt to end the process included. An interruption by the
        user, a lack of memory and a full disk are nobody's fault and stay what they are.
    """
    try:
        yield
    except GradeDesignError as error:
        if not always:
            raise
        raise type(error)(f"{subject}: {error}") from error
    except (KeyboardInterrupt, Interrupted, MemoryError):
        raise
    except BaseException as error:
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise PluginError(f"{subject} failed: {type(error).__name__}: {error}") from error
