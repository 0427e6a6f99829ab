"""3MF, OBJ, PLY, OFF and GLB for gradedesign: readers of parts, exporters of printed lattices."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import Exporter, PartReader, hookimpl
from gradedesign_formats.beams import why_no_beams
from gradedesign_formats.read_3mf import read_3mf
from gradedesign_formats.read_trimesh import read_glb, read_obj, read_off, read_ply
from gradedesign_formats.write_3mf import export_3mf, export_3mf_beams
from gradedesign_formats.write_ply import export_ply
from gradedesign_formats.write_trimesh import export_glb, export_obj, export_off

__all__ = ["gradedesign_exporters", "gradedesign_readers"]


@hookimpl
def gradedesign_readers() -> Iterator[PartReader]:
    """Register the readers, one a format."""
    yield PartReader(name="3mf", suffixes=(".3mf",), read=read_3mf)
    yield PartReader(name="obj", suffixes=(".obj",), read=read_obj)
    yield PartReader(name="ply", suffixes=(".ply",), read=read_ply)
    yield PartReader(name="off", suffixes=(".off",), read=read_off)
    yield PartReader(name="glb", suffixes=(".glb",), read=read_glb)


@hookimpl
def gradedesign_exporters() -> Iterator[Exporter]:
    """Register the exporters, one a format."""
    yield Exporter(name="3mf", suffix=".3mf", write=export_3mf)
    yield Exporter(
        name="3mf-beams",
        suffix=".3mf",
        write=export_3mf_beams,
        refuses=lambda p: why_no_beams(p.axes, p.cell_map, p.domain),
    )
    yield Exporter(name="obj", suffix=".obj", write=export_obj)
    yield Exporter(name="ply", suffix=".ply", write=export_ply)
    yield Exporter(name="off", suffix=".off", write=export_off)
    yield Exporter(name="glb", suffix=".glb", write=export_glb)
