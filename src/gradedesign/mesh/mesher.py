"""The record of a mesher: what fills a closed surface with tetrahedra."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, field

from gradedesign.workspace.worker import Option


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesher:
    """Fills closed surfaces with tetrahedra, in a process of its own.

    The limits of time and memory, the checks of the mesh, the split of long edges and the cache
    are gradedesign's and hold for every mesher.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[part] mesher`` names.
    worker : str
        Dotted name of a module, run as ``python -m``, that calls
        `gradedesign.workspace.worker.serve`.
    version : str
        Of what it meshes with: a mesh of another version is not taken from the cache.
    ways : tuple of (str, mapping)
        Attempts in their order, each in words and as options that the worker receives. They must
        share the geometric tolerance.
    """

    name: str
    worker: str
    version: str
    ways: tuple[tuple[str, Mapping[str, Option]], ...] = field(default=(("as it is", {}),))


#: The built-in mesher, after Hu et al. 2020, fTetWild.
PYTETWILD = Mesher(
    name="pytetwild",
    worker="gradedesign.mesh._tetwild_worker",
    version=importlib.metadata.version("pytetwild"),
    ways=(
        ("all threads, surface simplified first", {"threads": 0, "simplify": True}),
        ("one thread, surface simplified first", {"threads": 1, "simplify": True}),
        ("all threads, surface not simplified", {"threads": 0, "simplify": False}),
    ),
)
