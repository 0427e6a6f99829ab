"""The part of a case, read and repaired, if its surface shows that the case is possible on it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gradedesign.common.system.progress import report_step
from gradedesign.common.values.direction import FRAMES
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.printing.print_checks import require_voxels_fit
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.resolve.lattice_files import lattice_files
from gradedesign.design.resolve.member_size import edges_of_tets, with_member_size
from gradedesign.design.resolve.part_readers import part_readers
from gradedesign.design.resolve.part_repairer import part_repairer
from gradedesign.design.resolve.predicted_part_mesh import require_mesh_fits, with_mesh_size
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.support_conflicts import (
    require_agreeing,
    require_apart,
    require_supported,
)
from gradedesign.design.resolve.symmetry import with_symmetry
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.part_room import require_cells_fit
from gradedesign.geometry.part.mended import Mend
from gradedesign.geometry.part.part import Part, Reader, read_part
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.limits.kinds import require_possible
from gradedesign.mechanics.limits.limit_checks import require_displacements_fit


def fitting_part(case: Case, registry: Registry) -> tuple[Case, Part]:
    """The part as read and repaired, if its mesh, cells, supports and limits are possible.

    The case that comes with it states the mesh size, and what planes of symmetry hold. Where the
    density is stated, neither is asked for: nothing is meshed or analysed. Raises `CaseError`,
    `PartError`, `ResourceError`, `PluginError`: whatever is wrong, with file, line and key.
    """
    # A name that is not installed is told before the part is read, which may take seconds.
    lattice_files(case.output.formats, registry, case.where)
    report_step("reading and repairing the part")
    part = installed_part(case, registry)
    require_cells_fit(case.lattice, case.part, case.run.memory, case.where, part)
    if case.lattice.stated:
        return case, part
    meshed = with_mesh_size(case.part, part, *edges_of_tets(case.lattice))
    case = case.model_copy(
        update={
            "lattice": with_member_size(case.lattice, meshed, case.print, case.where),
            "part": meshed,
            "load_case": with_symmetry(case.load_case, part, case.where),
        }
    )
    require_mesh_fits(case.part, part, case.run.memory, case.where)
    longest = float(np.ptp(part.surface.vertices, axis=0).max())
    require_displacements_fit(case.limits, case.where, longest)
    require_apart(case.part, part, case.where)
    require_supported(case.load_case, part, case.where)
    require_agreeing(case.load_case, part, case.where)
    require_possible(registry.limits, case.limits, case.load_case, part.regions, case.where)
    return case, part


def installed_part(case: Case, registry: Registry) -> Part:
    """The part as the installed readers and repairers read it, if the printer takes it.

    Raises `CaseError`, `PartError`, `ResourceError`, `PluginError`: whatever is wrong, with file,
    line and key.
    """
    mend = part_repairer(case.part, case.run, registry, case.where)
    with locating(case.where, "part.file"):
        part = part_of(case, part_readers(case.part, case.run.memory, registry), mend)
    require_fits(case.print, part.surface, case.where)
    require_voxels_fit(case.print, part.surface, case.run.memory, case.where)
    return part


def part_of(case: Case, readers: Mapping[str, Reader], mend: Mend | None = None) -> Part:
    """The part of a case, with the regions and bodies that it names, see `read_part`."""
    named = [(f"keep[{k}].body", keep.body) for k, keep in enumerate(case.keep)]
    named += [(f"zone[{k}].body", zone.body) for k, zone in enumerate(case.zone)]
    return read_part(
        case.part,
        case.region,
        readers,
        case.where,
        bodies={key: body for key, body in named if body is not None},
        mend=mend,
    )


def require_fits(spec: PrintSpec | None, surface: SurfaceMesh, where: Where) -> None:
    """Refuse a part that is larger than ``[print] build_volume`` in its build direction.

    Raises CaseError with the extents of the part and the directions in which it would fit.
    """
    if spec is None or spec.build_volume is None:
        return
    room = np.array(spec.build_volume)
    extents = {
        name: np.ptp(surface.vertices @ np.array(frame, dtype=np.float64).T, axis=0)
        for name, frame in FRAMES.items()
    }
    size = extents[spec.build_direction]
    if (size <= room).all():
        return
    fitting = [name for name, extent in extents.items() if (extent <= room).all()]
    advice = f"take build_direction {', '.join(fitting)}" if fitting else "no direction fits"
    with locating(where, "print.build_volume"):
        raise CaseError(
            f"found a part of {' x '.join(f'{s:g}' for s in size)} mm, built towards "
            f"{spec.build_direction}, in {' x '.join(f'{s:g}' for s in room)} mm; expected "
            f"one that fits: {advice}"
        )
