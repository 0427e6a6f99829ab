"""The record of a mesher, which fills a closed surface with tetrahedra."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from numpy.typing import ArrayLike, NDArray

from gradedesign.common.system.worker import Option, serve

#: ``mesh(vertices, faces, options)`` to points and tetrahedra.
_MeshFunction: TypeAlias = Callable[
    [NDArray[Any], NDArray[Any], Mapping[str, Option]], tuple[ArrayLike, ArrayLike]
]


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
        `gradedesign.common.system.worker.serve`.
    version : str
        Version of the meshing library: a cached mesh of another version is not used.
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
    worker="gradedesign.geometry.tets._tetwild_worker",
    version=importlib.metadata.version("pytetwild"),
    ways=(
        ("all threads, surface simplified first", {"threads": 0, "simplify": True}),
        ("one thread, surface simplified first", {"threads": 1, "simplify": True}),
        ("all threads, surface not simplified", {"threads": 0, "simplify": False}),
    ),
)


def serve_mesher(mesh: _MeshFunction, *, load: Callable[[], object] = dict) -> None:
    """Run as the process of a mesher: read a surface, mesh it and return the mesh.

    Parameters
    ----------
    mesh : callable
        Takes ``vertices`` (n, 3) in mm, about the middle of their box, ``faces`` (m, 3),
        outward, and ``options``: ``edge_length`` in mm, ``relative_epsilon``, the distance of the
        mesh from the surface over the diagonal of its box, ``stop_energy``, at which fTetWild ends,
        and those of the way. Returns points (k, 3) in mm and tetrahedra (t, 4), positively
        oriented.
    load : callable
        Imports the libraries that ``mesh`` needs, so that running out of memory before the work
        begins can be told from running out of it at work.

    Examples
    --------
    In the module that a mesher of a plugin starts as a process::

        if __name__ == "__main__":
            serve_mesher(my_mesh_function)
    """

    def compute(
        arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Option]
    ) -> dict[str, ArrayLike]:
        points, tets = mesh(arrays["vertices"], arrays["faces"], options)
        return {"points": points, "tets": tets}

    serve(compute, load=load)
