"""A maker of cells: what turns the description that a case gives into a cell family."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gradedesign.common.values.suggest import instead
from gradedesign.errors import CaseError, GradeDesignError, Interrupted, PluginError
from gradedesign.geometry.cell.family import CellFamily


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellMaker:
    """Makes a cell family of plain data.

    Attributes
    ----------
    name : str
        Lower case with dashes.
    make : callable
        ``make(name, **options)``: a family of that name. Options are what the case states:
        numbers, texts, true or false, and lists of these; ``file`` is a ``pathlib.Path``. What is
        wrong with them is raised as a `PluginError` or `CaseError` that names the option.
    options : mapping of str to str
        Every option and what it means.
    required : tuple of str
        The options that a case must state.
    suffixes : tuple of str
        Of the file that it reads, lower case with dots; none if it reads no file.
    source : str
        Where the method comes from.
    """

    name: str
    make: Callable[..., CellFamily]
    options: Mapping[str, str] = field(default_factory=dict)
    required: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))


def make_cell(
    maker: CellMaker, name: str, options: Mapping[str, Any], file: Path | None
) -> CellFamily:
    """Make the cell family of a name from the options of a case.

    Raises CaseError for an option that the maker does not have or that is missing, a file where it
    takes none or another kind, and whatever the maker refuses. Raises PluginError if the maker
    breaks, or returns anything but the cell.
    """
    for key in options:
        if key not in maker.options:
            raise CaseError(
                f"lattice.own_cell.{key}: the maker '{maker.name}' has no such option; "
                f"{instead(key, maker.options, label='its options')}"
            )
    for key in maker.required:
        if key not in options:
            raise CaseError(
                f"lattice.own_cell: the maker '{maker.name}' needs {key}, {maker.options[key]}"
            )
    if file is not None and not maker.suffixes:
        raise CaseError(f"lattice.own_cell.file: the maker '{maker.name}' reads no file")
    if maker.suffixes and (file is None or file.suffix.lower() not in maker.suffixes):
        stated = "no file" if file is None else f"'{file.name}'"
        raise CaseError(
            f"lattice.own_cell.file: found {stated}; the maker '{maker.name}' reads "
            f"{', '.join(maker.suffixes)}"
        )
    arguments = dict(options) if file is None else {**options, "file": file}
    try:
        made = maker.make(name, **arguments)
    except PluginError as error:
        # The maker says what is wrong with what the case states.
        raise CaseError(f"lattice.own_cell: {error}") from error
    except (GradeDesignError, KeyboardInterrupt, Interrupted, MemoryError):
        raise
    except (TypeError, ValueError, ArithmeticError) as error:
        raise CaseError(
            f"lattice.own_cell: the maker '{maker.name}' cannot use its options: {error}"
        ) from error
    except BaseException as error:
        raise PluginError(f"the maker '{maker.name}' broke on its options: {error}") from error
    if not isinstance(made, CellFamily) or made.name != name:
        raise PluginError(
            f"the maker '{maker.name}' returned {type(made).__name__}, expected the cell family "
            f"'{name}'"
        )
    return made
