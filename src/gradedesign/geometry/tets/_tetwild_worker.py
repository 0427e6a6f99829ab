"""The only place that imports pytetwild: it crashes, hangs and holds the interpreter lock."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign.common.system.worker import Option
from gradedesign.geometry.tets.mesher import serve_mesher


def mesh_surface(
    vertices: NDArray[Any], faces: NDArray[Any], options: Mapping[str, Option]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Mesh the inside of a surface; see `serve_mesher`.

    The mesher's option sets add ``threads`` (0: all) and ``simplify``.
    """
    load()
    import pytetwild

    points, tets = pytetwild.tetrahedralize(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int32),
        edge_length_abs=float(options["edge_length"]),
        epsilon=float(options["relative_epsilon"]),
        stop_energy=float(options["stop_energy"]),
        num_threads=int(options["threads"]),
        simplify=bool(options["simplify"]),
        vtk_ordering=True,  # its own order has negative volumes
        quiet=True,
    )
    return points, tets


def load() -> None:
    """Import the mesher.

    Importing it imports pyvista, and VTK with it, for a function that we do not call and without
    asking for either: an empty module takes the place, in this process alone.
    """
    sys.modules.setdefault("pyvista", ModuleType("pyvista"))
    import pytetwild  # noqa: F401 - what takes most of the address space


if __name__ == "__main__":
    serve_mesher(mesh_surface, load=load)
