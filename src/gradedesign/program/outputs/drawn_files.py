"""Pictures of a run, drawn into its folder and entered in its manifest by their keys."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.resolve.shown_case import CaseShown
from gradedesign.design.verdict.shown import Shown
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.explicit import governing_load_case
from gradedesign.mechanics.explicit.support_zones import evaluated_at
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, built_density
from gradedesign.program.pictures.marks import action_marks, loads_note, region_marks
from gradedesign.program.pictures.pictures import (
    picture_deformed,
    picture_density,
    picture_lattice,
    picture_loads,
    picture_stress,
)
from gradedesign.program.store.run_folder import RunFolder


def loads_picture(
    out: RunFolder, case: CaseShown, unjudged: float, files: dict[str, str]
) -> tuple[str, ...]:
    """Draw supports and loads on the part; ``unjudged`` is its share near supports."""
    files["loads"] = "loads.png"
    warnings = picture_loads(
        out.path_of("loads.png"),
        case.part.surface,
        region_marks(case.load_cases, case.part, case.domain, case.support_zones),
        action_marks(case.load_cases, case.part),
        note=loads_note(case.load_cases, case.support_zones, unjudged),
    )
    _adopt_drawn(out, files, "loads")
    return warnings


def shown_density(part: HomogenisedModel, rho: FloatArray) -> FloatArray:
    """Densities of a design as they are shown ``(M,)``: 1 where the part is solid."""
    shown = np.where(part.solid_fraction >= 1.0, 1.0, built_density(part, rho))
    if part.member_fraction is not None:
        shown += part.member_fraction * (1.0 - shown)
    return np.asarray(shown)


def density_picture(
    out: RunFolder, mesh: TetMesh, shown: FloatArray, files: dict[str, str]
) -> tuple[str, ...]:
    """Draw the densities of a design, see `shown_density`."""
    files["density"] = "density.png"
    warnings = picture_density(out.path_of("density.png"), mesh, shown)
    _adopt_drawn(out, files, "density")
    return warnings


def lattice_pictures(
    out: RunFolder,
    domain: DesignDomain,
    limit: float | None,
    shown: Shown,
    files: dict[str, str],
) -> tuple[str, ...]:
    """Pictures of the lattice; ``limit`` is the allowed stress, MPa."""
    result = shown.analysed.result
    load_case = governing_load_case(result)
    fields, solid = shown.fields, shown.analysed.solid
    files |= {"stress": "stress.png", "deformed": "deformed.png"}
    warnings = [
        *lattice_picture(out, shown.surface, domain, files),
        *picture_stress(
            out.path_of("stress.png"),
            fields.surface,
            fields.von_mises,
            limit=limit,
            unjudged=~evaluated_at(fields.surface.vertices.T, solid.support_zones),
            title=f"Stress, load case {load_case}",
        ),
        *picture_deformed(
            out.path_of("deformed.png"),
            fields.surface,
            fields.displacement,
            title=f"Deformed body, load case {load_case}",
        ),
    ]
    for name in ("stress", "deformed"):
        _adopt_drawn(out, files, name)
    return tuple(warnings)


def lattice_picture(
    out: RunFolder,
    surface: SurfaceMesh,
    domain: DesignDomain,
    files: dict[str, str],
    **options: str,
) -> tuple[str, ...]:
    """Draw the printed surface, cut open where its outside is closed."""
    files["lattice"] = "lattice.png"
    warnings = picture_lattice(out.path_of("lattice.png"), surface, opened=domain.closed, **options)
    _adopt_drawn(out, files, "lattice")
    return warnings


def _adopt_drawn(out: RunFolder, files: dict[str, str], name: str) -> None:
    """Enter a picture in the manifest; one that could not be drawn left a warning instead."""
    if (out.path / files[name]).is_file():
        out.adopt(files[name])
    else:
        del files[name]
