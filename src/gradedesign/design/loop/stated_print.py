"""The print of a lattice of stated density: its surface, or layers of its field alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradedesign.common.system.progress import counted, report_step
from gradedesign.design.loop.exported_surface import case_surface
from gradedesign.design.printing.as_built_body import AsBuiltBody, as_built_body
from gradedesign.design.printing.print_checks import check_printed
from gradedesign.design.printing.printability import Printability
from gradedesign.design.printing.wall_thickness import WallThickness, wall_thickness
from gradedesign.design.resolve.lattice_files import LatticeFile, printed_lattice
from gradedesign.design.resolve.stated_lattice import StatedLattice
from gradedesign.errors import blaming
from gradedesign.geometry.contour.islands import Islands, refuse_large
from gradedesign.geometry.formats.printed_lattice import MeasuredField, PrintedLattice, SampledPrint
from gradedesign.geometry.lattice.lattice import lattice_field
from gradedesign.geometry.lattice.printed_surface import first_step
from gradedesign.geometry.lattice.slab_density import (
    SlabDensities,
    field_points,
    layered_density,
    slab_density,
    total,
)
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume

#: Keys of ``[print]`` that layers need; any other one needs the surface.
_OF_LAYERS = {"layer_height", "pixel_size", "build_direction", "build_volume"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceMeasures:
    """Measures of a printed surface."""

    islands: Islands  #: Disconnected components that were removed from it.
    thickness: WallThickness
    printability: Printability | None  #: How it is made, where the case has ``[print]``.
    built: AsBuiltBody | None = None  #: What is built of it, where the case has ``[process]``.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatedPrint:
    """The print of a lattice of stated density and its measures."""

    lattice: PrintedLattice  #: As exporters receive it.
    slabs: tuple[SlabDensities, ...]  #: Across x, y and z.
    volume: float  #: mm^3.
    dropped: int  #: Disconnected components that were left out.
    dropped_share: float  #: Their share of the volume before.
    sizes: Mapping[str, Any]  #: Of the grid, or of layers and pixels, mm.
    surface: SurfaceMeasures | None  #: None where layers alone are made.
    made_of: str  #: Words on triangles or layers.

    @property
    def words(self) -> str:
        """One line: what it is made of, and its density beside the stated one."""
        slabs = self.slabs[0]
        return (
            f"{self.made_of}, density {total(slabs, 'surface'):.4f} of {total(slabs, 'target'):.4f}"
        )


def stated_print(stated: StatedLattice) -> StatedPrint:
    """Make what the files of a case need: the surface, or layers of the field alone.

    Raises LatticeError if there is no solid, too much of it would be disconnected, or what a format
    refuses, such as layers that do not hold the volume of the field.
    """
    return _in_layers(stated) if _layers_alone(stated) else _with_surface(stated)


def _with_surface(stated: StatedLattice) -> StatedPrint:
    """Surface of a lattice without disconnected components, and its densities."""
    case, part, design = stated.case, stated.part.surface, stated.design
    size = case.lattice.cell_size
    surface, islands, step = case_surface(
        case.print, case.lattice, case.run.memory, part, design, first_step(size, stated.wall)
    )
    field = lattice_field(design, band=3 * step, single=True)
    thickness = max(size, design.cell_size)
    depth, _ = solid_layers(design.domain, band=3 * step)
    slabs = tuple(
        slab_density(*(design, field, surface, part), axis=axis, thickness=thickness, depth=depth)
        for axis in counted(range(3), "density by slabs, axis", 3)
    )
    report_step("thickness of the printed solid")
    measured = wall_thickness(surface)
    return StatedPrint(
        lattice=printed_lattice(
            case.named, case.print, surface, design, stated.material, part=part, file=case.part.file
        ),
        slabs=slabs,
        volume=enclosed_volume(surface),
        dropped=islands.dropped,
        dropped_share=islands.dropped_share,
        sizes={"grid_mm": step},
        surface=SurfaceMeasures(
            islands=islands,
            thickness=measured,
            printability=check_printed(case.print, part, surface, measured),
            built=as_built_body(stated.process, surface, part, size / 2.0),
        ),
        made_of=f"{len(surface.faces)} triangles at a grid of {step:.3g} mm",
    )


def _layers_alone(stated: StatedLattice) -> bool:
    """Whether a case needs no surface of the lattice.

    True where every format reads the field only and one samples it in layers, ``[print]`` has no
    keys but those of layers and of the build volume, and there is no ``[process]``.
    """
    printer, formats = stated.case.print, stated.formats
    return (
        any(file.exporter.sample for file in formats)
        and not any(file.exporter.needs_surface for file in formats)
        and len(formats) == len(set(stated.case.output.formats))
        and stated.process is None
        and printer is not None
        and printer.layer_height is not None
        and printer.model_fields_set <= _OF_LAYERS
    )


def _in_layers(stated: StatedLattice) -> StatedPrint:
    """Layers of a lattice and its densities, without contouring its surface."""
    case, design, part, material = stated.case, stated.design, stated.part, stated.material
    nothing = SurfaceMesh(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))
    lattice = printed_lattice(
        case.named, case.print, nothing, design, material, part=part.surface, file=case.part.file
    )
    pixel = lattice.pixel_size or lattice.layer_height
    exporter = next(file.exporter for file in stated.formats if file.exporter.sample is not None)
    if exporter.fields is None or pixel is None:
        raise TypeError("layers alone are made of a field and a stated height")
    field = field_points(design, exporter.fields(design, 3.0 * pixel))
    bounds = np.stack([design.domain.lower, design.domain.upper])
    lattice = replace(lattice, measured=MeasuredField(bounds=bounds, volume=field.volume))
    layers = _sampled(lattice, stated.formats)
    volume = layers.printed_volume
    mass = None if material is None else volume * material.density * 1e6
    thickness = max(case.lattice.cell_size, design.cell_size)
    return StatedPrint(
        lattice=replace(lattice, sampled=layers, mass_g=mass),
        slabs=layered_density(
            design, field, part.surface, layers.axis_volumes(), thickness=thickness
        ),
        volume=volume,
        dropped=layers.dropped,
        dropped_share=layers.dropped_share,
        sizes=layers.sizes,
        surface=None,
        made_of=layers.words,
    )


def _sampled(lattice: PrintedLattice, formats: Sequence[LatticeFile]) -> SampledPrint:
    """Samples of the field by the first format that takes them, for all formats.

    Errors are those of the format, and of what is disconnected.
    """
    file = next(file for file in formats if file.exporter.sample is not None)
    sample = file.exporter.sample
    if sample is None:
        raise TypeError("no format samples the field")
    with blaming(f"exporter {file.exporter.name!r} of {file.source}", always=False):
        samples = sample(lattice, [one.exporter.name for one in formats])
    refuse_large(samples.dropped, samples.dropped_share)
    return samples
