"""The printed surface as OBJ, OFF or GLB, encoded by trimesh and read back by our readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.errors import ResourceError
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.read_trimesh import read_glb, read_obj, read_off, y_up
from gradedesign.geometry.formats.write_stl import VOLUME_TOLERANCE, float32_vertices
from gradedesign.geometry.part.raw_triangles import UNIT_MM, RawTriangles
from gradedesign.geometry.triangles.edge_balance import edge_balance
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

#: Decimals of coordinates in text, mm: below the steps of float32 above 0.01 mm.
_DIGITS = 9


def export_obj(path: Path, lattice: PrintedLattice) -> None:
    """Write the printed lattice as OBJ, in mm, with its metadata as comments.

    Raises
    ------
    LatticeError
        If float32 cannot hold its detail.
    ResourceError
        If what is read back differs.
    """
    text = _encoded(lattice, 1.0, "obj", digits=_DIGITS, header="\n# ".join(_lines(lattice)))
    path.write_text(text, encoding="utf-8")
    _require_same(path, lattice, read_obj)


def export_off(path: Path, lattice: PrintedLattice) -> None:
    """Write the printed lattice as ASCII OFF, in mm; errors as of `export_obj`."""
    text = _encoded(lattice, 1.0, "off", digits=_DIGITS)
    comments = "".join(f"# {line}\n" for line in _lines(lattice))
    path.write_text(f"OFF\n{comments}{text.removeprefix('OFF').lstrip()}", encoding="utf-8")
    _require_same(path, lattice, read_off)


def export_glb(path: Path, lattice: PrintedLattice) -> None:
    """Write the printed lattice as GLB, in metres and with the case's z up, as the format wants.

    Raises
    ------
    LatticeError, ResourceError
        As `export_obj`.
    """

    def note(tree: dict[str, Any]) -> None:
        tree["asset"]["extras"] = lattice.metadata

    upright = replace(
        lattice,
        surface=SurfaceMesh(vertices=y_up(lattice.surface.vertices), faces=lattice.surface.faces),
    )
    path.write_bytes(
        _encoded(upright, 1.0 / UNIT_MM["m"], "glb", tree_postprocessor=note, scene=True)
    )
    _require_same(path, lattice, read_glb)


def _lines(lattice: PrintedLattice) -> list[str]:
    """Metadata of a lattice, one printable line each."""
    lines = [f"{key}: {value}" for key, value in lattice.metadata.items()]
    return ["".join(c if c.isprintable() else " " for c in line) for line in lines]


def _encoded(
    lattice: PrintedLattice, scale: float, kind: str, *, scene: bool = False, **options: Any
) -> Any:
    """Write the printed surface in a format of trimesh; return its bytes or text.

    Vertices that float32 would round to one point are moved apart before.
    """
    import trimesh

    mesh = trimesh.Trimesh(
        vertices=float32_vertices(lattice.surface.vertices * scale),
        faces=lattice.surface.faces,
        process=False,
    )
    if not scene:
        return mesh.export(file_type=kind, **options)
    whole = trimesh.Scene()
    whole.add_geometry(mesh, node_name=lattice.name, geom_name=lattice.name)
    return whole.export(file_type=kind, **options)


def _require_same(
    path: Path, lattice: PrintedLattice, read: Callable[[Path], RawTriangles]
) -> None:
    """Compare count, closedness and volume of the file with those of the lattice."""
    raw = read(path)
    corners = raw.corners * UNIT_MM[raw.unit or "mm"]
    volume = enclosed_volume(lattice.surface)
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    enclosed = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
    closed = edge_balance(raw.corners) == 0
    if (
        len(corners) != len(lattice.surface.faces)
        or not closed
        or not abs(enclosed - volume) <= VOLUME_TOLERANCE * abs(volume)
    ):
        raise ResourceError(
            f"{path} reads back as {len(corners)} triangles that {'' if closed else 'do not '}"
            f"close, {enclosed:g} mm^3; expected {len(lattice.surface.faces)} that close, "
            f"{volume:g} mm^3 within 0.1 %; check the disk and write it again"
        )
