"""The record of a repairer, which mends a damaged surface in a process of its own."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.common.system.worker import Option, serve

#: ``repair(vertices, faces, options)`` to vertices, faces and counted changes.
_RepairFunction: TypeAlias = Callable[
    [NDArray[Any], NDArray[Any], Mapping[str, Option]],
    tuple[ArrayLike, ArrayLike, Mapping[str, int]],
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repairer:
    """Mends the surface of a part, in a process of its own.

    gradedesign welds the surface before and checks it afterwards: the part is refused unless the
    mended surface is closed and lies where the file's did.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[part] repair`` names.
    worker : str
        Dotted name of a module, run as ``python -m``, that calls `gradedesign.serve_repairer`.
    options : mapping of str to str
        Every option of ``[part.repair_options]`` and what it means.
    """

    name: str
    worker: str
    options: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))


def serve_repairer(repair: _RepairFunction, *, load: Callable[[], object] = dict) -> None:
    """Run as the process of a repairer: read a surface, mend it and return the result.

    Parameters
    ----------
    repair : callable
        Takes ``vertices`` (n, 3) in mm, about the middle of their box, ``faces`` (m, 3), welded
        and turned to agree with their neighbours, and the ``options`` of the case, lengths in mm.
        Returns vertices (k, 3), faces (l, 3) and its changes, counted by name.
    load : callable
        Imports the libraries that ``repair`` needs, so that running out of memory before the work
        begins can be told from running out of it at work.

    Examples
    --------
    In the module that a repairer of a plugin starts as a process::

        if __name__ == "__main__":
            serve_repairer(my_repair_function)
    """

    def compute(
        arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Option]
    ) -> dict[str, ArrayLike]:
        vertices, faces, changes = repair(arrays["vertices"], arrays["faces"], options)
        counted = json.dumps({key: int(count) for key, count in changes.items()})
        return {
            "vertices": vertices,
            "faces": faces,
            "changes": np.frombuffer(counted.encode("utf-8"), dtype=np.uint8),
        }

    serve(compute, load=load)
