"""Linear static analyses on tetrahedra as CalculiX decks, which ``ccx`` runs as written.

Supports and loads are those of the nodes, so that both programs solve the same equations. Stiffness
is carried element by element: tetrahedra of equal stiffness share one material.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gradedesign import (
    AnalysedModel,
    AnisotropicStiffness,
    FinishedRun,
    IsotropicStiffness,
    ModelStep,
    ResourceError,
)

_T = TypeVar("_T")

#: Elements by nodes; CalculiX numbers corners and edges of both as `TetSpace` does.
_ELEMENTS = {4: "C3D4", 10: "C3D10"}
#: Constants D11, D12, D22, D13 ... D66 as ``*ELASTIC, TYPE=ANISO`` wants them: the upper triangle
#: by columns, order xx, yy, zz, xy, xz, yz (CalculiX CrunchiX manual, ``*ELASTIC``).
_ORDER = (0, 1, 2, 5, 4, 3)
_ANISO = tuple((_ORDER[i], _ORDER[j]) for j in range(6) for i in range(j + 1))
#: Most characters of a set's name.
_LONGEST = 60
#: A model whose displacements differ by more than this share from those of the run gets a warning.
_SAME_MODEL = 1e-3


def write_decks(run: FinishedRun) -> list[str]:
    """Write a deck of every model that was analysed; return warnings."""
    warnings: list[str] = []
    for model in run.models():
        words = _difference(model)
        warnings += words
        deck = replace(model, title=(*model.title, *words))
        run.write(f"{model.name}.inp", partial(_write, deck), key=f"{model.name}_inp")
    for name, reason in run.no_model.items():
        warnings.append(
            f"{name}.inp is not written: {reason}; a design that is accepted with [run] "
            f'acceptance = "whole" has its deck'
        )
    return warnings


def _difference(model: AnalysedModel) -> tuple[str, ...]:
    """Words on a model whose elements do not vary their stiffness as those of the run do."""
    if model.off <= _SAME_MODEL:
        return ()
    return (
        f"{model.name}.inp has one stiffness for each tetrahedron, while skins, walls and "
        "turned cells vary it inside; its displacements differ from those of the model of sizing "
        f"by up to {100 * model.off:.2g} % of the largest one",
    )


def _write(deck: AnalysedModel, path: Path) -> None:
    write_calculix(path, deck)


def write_calculix(path: Path, deck: AnalysedModel) -> None:
    """Write a deck and read its nodes, elements and loads back.

    Raises
    ------
    ResourceError
        If what is read back differs.
    """
    with path.open("wb") as handle:
        for lines in _batches(_lines(deck), 4096):
            handle.write(("\n".join(lines) + "\n").encode("utf-8"))
    _read_back(path, deck)


def _set_names(names: Iterable[str]) -> dict[str, str]:
    """Names of sets by names of regions: letters, digits and underscores, each different.

    Examples
    --------
    >>> set_names(["lug hole", "lug-hole", "1 < 2"])
    {'lug hole': 'LUG_HOLE', 'lug-hole': 'LUG_HOLE_2', '1 < 2': 'N_1_2'}
    """
    set_of_region: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_")[:_LONGEST]
        plain = plain if plain[:1].isalpha() else f"N_{plain}".rstrip("_")
        number, unique = 1, plain
        while unique in ("ALL", *set_of_region.values()):
            number += 1
            unique = f"{plain}_{number}"
        set_of_region[name] = unique
    return set_of_region


def _lines(deck: AnalysedModel) -> Iterator[str]:
    heated = any(step.temperature_change for step in deck.steps)
    yield from (f"** {_printable(line)}" for line in deck.title)
    yield "** units: mm, N, MPa, K"
    for step in deck.steps:
        yield (
            f"** load case {_printable(step.name)}: largest displacement of a node "
            f"{step.displacement:.6g} mm by gradedesign"
        )
    yield "*NODE, NSET=ALL"
    for number, (x, y, z) in enumerate(deck.space.nodes.T, 1):
        yield f"{number}, {_number(x)}, {_number(y)}, {_number(z)}"
    yield from _elements(deck, heated=heated)
    names = _set_names(deck.node_sets)
    for name, nodes in deck.node_sets.items():
        yield f"** region {_printable(name)}"
        yield f"*NSET, NSET={names[name]}"
        for row in _batches((nodes + 1).tolist(), 16):
            yield ", ".join(map(str, row))
    if heated:
        yield from ("*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0.")
    for step in deck.steps:
        yield from _step(step, heated=heated)


def _elements(deck: AnalysedModel, *, heated: bool) -> Iterator[str]:
    """Elements with one material for all of equal stiffness."""
    constants, kind = _constants(deck.stiffness)
    table, material = np.unique(constants, axis=0, return_inverse=True)
    material = material.ravel()
    order = np.argsort(material, kind="stable")
    nodes = deck.space.elements.T + 1
    now = -1
    for element in order.tolist():
        if material[element] != now:
            now = int(material[element])
            yield f"*ELEMENT, TYPE={_ELEMENTS[nodes.shape[1]]}, ELSET=E{now + 1}"
        yield ", ".join(map(str, (element + 1, *nodes[element].tolist())))
    for number, row in enumerate(table, 1):
        yield f"*MATERIAL, NAME=M{number}"
        yield f"*ELASTIC, TYPE={kind}"
        yield from (", ".join(map(_number, line)) for line in _batches(row.tolist(), 8))
        if heated:
            yield from ("*EXPANSION", _number(deck.thermal_expansion))
        yield f"*SOLID SECTION, ELSET=E{number}, MATERIAL=M{number}"


def _constants(
    stiffness: IsotropicStiffness | AnisotropicStiffness,
) -> tuple[NDArray[np.float64], str]:
    """Constants of every element ``(m, 2 or 21)`` as they are written, and their type."""
    if isinstance(stiffness, IsotropicStiffness):
        e = stiffness.E
        return np.stack([e, np.full_like(e, stiffness.nu)], axis=1), "ISO"
    c = stiffness.C
    return np.stack([0.5 * (c[i, j] + c[j, i]) for i, j in _ANISO], axis=1), "ANISO"


def _step(step: ModelStep, *, heated: bool) -> Iterator[str]:
    yield from (f"** load case {_printable(step.name)}", "*STEP", "*STATIC", "*BOUNDARY, OP=NEW")
    fixed, value = step.supports.fixed, step.supports.value
    for node, axis in np.argwhere(fixed.T).tolist():
        yield f"{node + 1}, {axis + 1}, {axis + 1}, {_number(value[axis, node])}"
    # A step without loads would keep those of the step before.
    loaded = np.argwhere(step.force.T != 0.0).tolist() or [[0, 0]]
    yield "*CLOAD, OP=NEW"
    for node, axis in loaded:
        yield f"{node + 1}, {axis + 1}, {_number(step.force[axis, node])}"
    if heated:
        yield from ("*TEMPERATURE, OP=NEW", f"ALL, {_number(step.temperature_change)}")
    yield from ("*NODE FILE", "U, RF", "*EL FILE", "S, E", "*END STEP")


def _batches(items: Iterable[_T], size: int) -> Iterator[list[_T]]:
    rest = iter(items)
    while batch := list(islice(rest, size)):
        yield batch


def _number(value: float) -> str:
    """A number in at most the 20 characters that CalculiX reads."""
    return f"{value:.12e}"


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def _read_back(path: Path, deck: AnalysedModel) -> None:
    """Compare nodes, elements and total loads of the file with those of the deck."""
    nodes, elements, loads, card = 0, 0, [], ""
    middle = np.zeros(3)
    with path.open(encoding="utf-8") as handle:
        for line in handle:
            if line.startswith("**"):
                continue
            if line.startswith("*"):
                card = line.split(",")[0].strip()
                if card == "*STEP":
                    loads.append(np.zeros(3))
            elif card == "*NODE":
                nodes += 1
                middle += np.array(line.split(",")[1:], dtype=np.float64)
            elif card == "*ELEMENT":
                elements += 1
            elif card == "*CLOAD":
                _, axis, force = line.split(",")
                loads[-1][int(axis) - 1] += float(force)
    total_loads = np.array([step.force.sum(axis=1) for step in deck.steps])
    size = max((float(np.abs(step.force).sum()) for step in deck.steps), default=0.0)
    places = deck.space.nodes
    same = (
        (nodes, elements) == (deck.space.node_count, deck.space.element_count)
        and card == "*END STEP"
        and np.shape(loads) == total_loads.shape
        and float(np.abs(np.array(loads) - total_loads).max()) <= 1e-9 * size
        and np.allclose(middle, places.sum(axis=1), rtol=1e-9, atol=1e-9 * np.abs(places).sum())
    )
    if not same:
        raise ResourceError(
            f"{path} reads back as {nodes} nodes, {elements} elements and {len(loads)} steps, or "
            f"with other places or loads; expected {deck.space.node_count}, "
            f"{deck.space.element_count} and {len(deck.steps)}; check the disk and write it again"
        )
