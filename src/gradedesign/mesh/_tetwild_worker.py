"""The only place that imports pytetwild: it crashes, hangs and holds the interpreter lock."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign.workspace.worker import Option, serve


def mesh_surface(
    arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Option]
) -> dict[str, NDArray[Any]]:
    """Mesh the inside of a surface.

    Parameters
    ----------
    arrays : mapping
        ``vertices`` (n, 3) in mm and ``faces`` (m, 3).
    options : mapping
        ``edge_length`` mm, ``relative_epsilon`` of the bounding box's diagonal, ``stop_energy``,
        ``threads`` (0: all), ``simplify``.

    Returns
    -------
    mapping
        ``points`` (n, 3) in mm and ``tets`` (m, 4), positively oriented.
    """
    import pytetwild

    points, tets = pytetwild.tetrahedralize(
        np.ascontiguousarray(arrays["vertices"], dtype=np.float64),
        np.ascontiguousarray(arrays["faces"], dtype=np.int32),
        edge_length_abs=float(options["edge_length"]),
        epsilon=float(options["relative_epsilon"]),
        stop_energy=float(options["stop_energy"]),
        num_threads=int(options["threads"]),
        simplify=bool(options["simplify"]),
        vtk_ordering=True,  # its own order has negative volumes
        quiet=True,
    )
    return {"points": points, "tets": tets}


def load() -> None:
    """Import the mesher."""
    import pytetwild  # noqa: F401 - what takes most of the address space


if __name__ == "__main__":
    serve(mesh_surface, load=load)
