"""Cells that a case states as a formula."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.formula import (
    CONSTANTS,
    FUNCTIONS,
    Formula,
    evaluate_formula,
    parse_formula,
)
from gradedesign.common.values.suggest import instead, shown
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.maker import CellMaker

#: Cell coordinates of a formula: a cell reaches from 0 to 1 along each.
AXES = ("x", "y", "z")
KINDS = ("network", "sheet")
_SYMMETRIES = ("cubic", "tetragonal", "orthotropic", "none")
#: Points of the cell at which a formula is tried before it is used. Chosen, not measured.
_TRIALS = 4096
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)


def formula_cell(
    name: str,
    *,
    formula: object,
    kind: object = "network",
    symmetry: object = "none",
    parameters: object = (),
) -> CellFamily:
    """Cell whose solid lies where a formula is below a level, or near where it is zero.

    Raises CaseError, naming the option, what was found and what would be right.

    - ``formula``: in x, y, z, 0 to 1 in the cell, its parameters, and what `parse_formula` knows
    - ``kind``: "network" or "sheet"; ``f <= t``, or ``|f| <= t``
    - ``symmetry``: "cubic", "tetragonal", "orthotropic" or "none" of the effective stiffness;
      declared cubic symmetry is checked when it is computed
    - ``parameters``: names and defaults; ``[lattice.parameters]`` of a case overrides them

    Examples
    --------
    >>> cell = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell.shape(np.array([[0.5], [0.5], [0.5]]))
    array([-3.])
    """
    for key, value, allowed in (("kind", kind, KINDS), ("symmetry", symmetry, _SYMMETRIES)):
        if value not in allowed:
            raise _wrong(key, f"found {shown(value)}; {instead(str(value), allowed)}")
    defaults = _defaults(parameters)
    if not isinstance(formula, str):
        raise _wrong("formula", f'found {shown(formula)}; expected a text such as "cos(2*pi*x)"')
    try:
        parsed = parse_formula(formula, variables=(*AXES, *defaults))
    except CaseError as error:
        raise _wrong("formula", str(error)) from error
    unused = [key for key in defaults if key not in parsed.variables]
    if unused:
        raise _wrong("parameters", f"the formula has no {', '.join(unused)}; leave it out")
    shape = _shape(parsed, both_sides=kind == "sheet")
    _try(shape(np.random.default_rng(2).random((3, _TRIALS)), **defaults))
    return CellFamily(
        name=name,
        shape=shape,
        source=f"formula of the case: {formula}",
        parameters=defaults,
        symmetry=symmetry,  # type: ignore[arg-type]
        sides=2 if kind == "sheet" else 1,
    )


def _shape(formula: Formula, *, both_sides: bool) -> Callable[..., FloatArray]:
    """Shape function of a parsed formula."""

    def shape(u: FloatArray, **parameters: Any) -> FloatArray:
        values = dict(zip(AXES, np.asarray(u, dtype=np.float64), strict=True))
        value = evaluate_formula(formula, {**values, **parameters})
        return np.abs(value) if both_sides else value

    return shape


def _defaults(parameters: object) -> dict[str, float]:
    """Parameters by name, checked."""
    expected = 'expected pairs such as [["width", 0.2]]'
    if not isinstance(parameters, Sequence) or isinstance(parameters, str):
        raise _wrong("parameters", f"found {shown(parameters)}; {expected}")
    defaults: dict[str, float] = {}
    for pair in parameters:
        if not (
            isinstance(pair, Sequence)
            and len(pair) == 2
            and isinstance(pair[0], str)
            and isinstance(pair[1], int | float)
            and not isinstance(pair[1], bool)
        ):
            raise _wrong("parameters", f"found {shown(pair)}; {expected}")
        key, value = pair
        if not _WORD.fullmatch(key) or key in (*AXES, *CONSTANTS, *FUNCTIONS, *defaults):
            raise _wrong(
                "parameters",
                f"found the name {shown(key)}; expected a word that is no coordinate, constant or "
                f"function, once",
            )
        defaults[key] = float(value)
    return defaults


def _try(value: FloatArray) -> None:
    """Refuse a formula that is undefined or the same everywhere."""
    undefined = float(np.mean(~np.isfinite(value)))
    if undefined > 0:
        raise _wrong(
            "formula",
            f"it is not defined in {undefined:.1%} of the cell, such as at a division by zero or "
            f"the root of a negative number; expected a number for all x, y, z of 0 to 1",
        )
    if float(np.ptp(value)) <= 1e-12 * float(np.abs(value).max()):
        raise _wrong("formula", f"it is {value[0]:g} everywhere; expected one of x, y, z in it")


def _wrong(key: str, message: str) -> CaseError:
    return CaseError(f"lattice.own_cell.{key}: {message}")


FORMULA_MAKER = CellMaker(
    name="formula",
    make=formula_cell,
    options={
        "formula": "f in x, y, z of 0 to 1, and the parameters, such as "
        '"cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)"; it must repeat after 1',
        "kind": "network (solid where f <= level, the default) or sheet (|f| <= level)",
        "symmetry": "cubic, tetragonal, orthotropic or none (the default), of the stiffness",
        "parameters": 'names and defaults, such as [["width", 0.2]]',
    },
    required=("formula",),
    source="level sets of periodic functions, as in A. H. Schoen, NASA TN D-5541 (1970)",
)
