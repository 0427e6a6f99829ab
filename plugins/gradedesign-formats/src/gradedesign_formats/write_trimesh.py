"""The printed surface as OBJ, OFF or GLB, encoded by trimesh and read back by our readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gradedesign import (
    UNIT_MM,
    PrintedLattice,
    RawTriangles,
    SurfaceMesh,
    float32_vertices,
    require_read_back,
)
from gradedesign_formats.read_trimesh import read_glb, read_obj, read_off, y_up

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
    require_read_back(path, [raw.corners * UNIT_MM[raw.unit or "mm"]], lattice.surface)
