"""Layers of the printed lattice for gradedesign: Common Layer Interface files and PNG stacks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gradedesign import Exporter, LatticeDesign, PrintedLattice, hookimpl
from gradedesign.fields import Field
from gradedesign_layers.cli_layers import export_cli, export_cli_binary
from gradedesign_layers.dense_lattice import dense_lattice
from gradedesign_layers.layer_stack import Layers
from gradedesign_layers.layers import slice_lattice, why_no_layers
from gradedesign_layers.png_stack import export_png_stack

__all__ = ["gradedesign_exporters"]

#: Formats that print contours, which hold thin struts better than pixels.
_CONTOURED = {"cli": export_cli, "cli-binary": export_cli_binary}


def _sample(lattice: PrintedLattice, formats: Sequence[str]) -> Layers:
    """Layers for all formats that are written."""
    return slice_lattice(lattice, contoured=set(formats) <= set(_CONTOURED))


def _fields(design: LatticeDesign, reach: float) -> tuple[Field, Field]:
    """Fields of the lattice and of the part alone."""
    dense = dense_lattice(design, reach)
    return dense, dense.part


@hookimpl
def gradedesign_exporters() -> Iterator[Exporter]:
    """Register the formats of layers."""
    for name, write in {**_CONTOURED, "png-stack": export_png_stack}.items():
        yield Exporter(
            name=name,
            suffix=".cli" if name in _CONTOURED else ".zip",
            write=write,
            needs_surface=False,
            sample=_sample,
            fields=_fields,
            refuses=why_no_layers,
        )
