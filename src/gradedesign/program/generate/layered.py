"""A lattice written as layers only, without contouring its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradedesign.design.case.generate_schema import GenerateCase
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.resolve.lattice_files import (
    LatticeFile,
    printed_lattice,
    write_lattice_files,
)
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.provenance import stamped
from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import blaming
from gradedesign.geometry.contour.islands import refuse_large
from gradedesign.geometry.formats.printed_lattice import MeasuredField, PrintedLattice, SampledPrint
from gradedesign.geometry.lattice.slab_density import field_points, layered_density, total
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.material.material import Material
from gradedesign.program.generate.generate_files import SLABS_NAME, slab_table
from gradedesign.program.generate.stated_result import StatedLattice, stated_result
from gradedesign.program.outputs.files import RESULT_NAME, write_result
from gradedesign.program.store.run_folder import RunFolder

#: Keys of ``[print]`` that layers need; any other one needs the surface.
_OF_LAYERS = {"layer_height", "pixel_size", "build_direction", "build_volume"}
#: Note in the result in place of the measures of the surface.
NO_SURFACE = (
    "layers alone are asked for, so no surface was made: thickness, overhangs, islands, closed "
    "voids and the picture are left out; add stl to [output] formats for them"
)


def layers_alone(case: GenerateCase, formats: Sequence[LatticeFile]) -> bool:
    """Whether a case needs no surface of the lattice.

    True where every format reads the field only and one samples it in layers, and ``[print]`` has
    no keys but those of layers and of the build volume.
    """
    return (
        any(file.exporter.sample for file in formats)
        and not any(file.exporter.needs_surface for file in formats)
        and len(formats) == len(set(case.output.formats))
        and case.print is not None
        and case.print.layer_height is not None
        and case.print.model_fields_set <= _OF_LAYERS
    )


def generate_layers(
    case: GenerateCase,
    registry: Registry,
    stated: StatedLattice,
    formats: Sequence[LatticeFile],
    material: Material | None,
    to: tuple[RunFolder, Announcer],
) -> RunResult:
    """Make and write the layers of a lattice, its densities and result.json; return the result.

    Raises
    ------
    LatticeError
        If too much of the layers is disconnected, or what the format refuses, such as layers that
        do not hold the volume of the field.
    """
    (out, announce), design, part = to, stated.design, stated.part
    with announce.stage("lattice"):
        nothing = SurfaceMesh(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))
        lattice = printed_lattice(case, part.surface, nothing, design, material)
        pixel = lattice.pixel_size or lattice.layer_height
        if lattice.dense_field is None or pixel is None:
            raise TypeError("layers alone are made of a field and a stated height")
        fields = lattice.dense_field(3.0 * pixel)
        field = field_points(design, (fields, fields.part))
        bounds = np.stack([design.domain.lower, design.domain.upper])
        lattice = replace(lattice, measured=MeasuredField(bounds=bounds, volume=field.volume))
        layers = _sampled(lattice, formats)
        volume = layers.printed_volume
        mass = None if material is None else volume * material.density * 1e6
        lattice = replace(lattice, sampled=layers, mass_g=mass)
        thickness = max(case.lattice.cell_size, design.cell_size)
        slabs = layered_density(
            design, field, part.surface, layers.axis_volumes(), thickness=thickness
        )
    announce.say(
        "lattice",
        f"{layers.words}, density {total(slabs[0], 'surface'):.4f} of "
        f"{total(slabs[0], 'target'):.4f}",
    )
    printed = (volume, layers.dropped, layers.dropped_share)
    result = stated_result((case, registry), stated, slabs, printed, material)
    if joints := result.measures["joints_mm3"]:
        announce.say("lattice", f"joints add {joints:.4g} mm^3")
    cell = {**result.measures["cell"], **layers.sizes}
    with announce.stage("output"):
        files = {"slabs": SLABS_NAME, "result": RESULT_NAME}
        files |= write_lattice_files(out, formats, lattice)
        out.write_text(SLABS_NAME, slab_table(slabs))
    result = replace(
        result,
        folder=out.path,
        files=files,
        measures={
            **result.measures,
            "cell": cell,
            "disconnected": {"count": layers.dropped, "volume_share": layers.dropped_share},
        },
        warnings=(*result.warnings, NO_SURFACE),
        timing_s=announce.timing(),
    )
    result = stamped(out, case, result, [file.name for file in formats])
    write_result(out, result)
    return result


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
