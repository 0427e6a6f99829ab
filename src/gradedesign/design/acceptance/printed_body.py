"""The solid of the printed file, measured: volumes by phase, thickness, and what was analysed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.design.acceptance.body_comparison import BodyComparison, compare_bodies
from gradedesign.design.printing.wall_thickness import WallThickness, wall_thickness
from gradedesign.geometry.lattice.domain import LATTICE, DesignDomain, printed_phase_at
from gradedesign.geometry.triangles.printed_field import printed_field
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.mechanics.explicit.measures import PHASES

#: Sample points of the box around a solid whose phases are told apart: their volumes are then
#: within about 0.1 % of the whole.
SAMPLES = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedBody:
    """Measures of the printed file."""

    #: By phase. Phases that the solid has; together the volume that the file encloses.
    volumes_mm3: Mapping[str, float]
    thickness: WallThickness
    comparison: BodyComparison  #: With the solid of the explicit analysis.
    joints_mm3: float = 0.0  #: Volume of the lattice that blended joints add.

    def mass_g(self, density: float, phase: str | None = None) -> float:
        """Mass of the file or of one phase of it, g, from a density in t/mm^3."""
        phases = self.volumes_mm3
        volume = sum(phases.values()) if phase is None else phases.get(phase, 0.0)
        return volume * density * 1e6


def measure_printed(
    surface: SurfaceMesh,
    analysed: SurfaceMesh,
    element: float,
    domain: DesignDomain,
    *,
    elements_mm3: float,
) -> PrintedBody:
    """Measure the surface of the printed file.

    - ``surface``: as read back
    - ``analysed``: of the solid that the explicit analysis solved
    - ``element``, mm: element size of that analysis
    - ``domain``: tells the phases apart
    - ``elements_mm3``, mm^3: solid volume of the elements of that analysis
    """
    report_step("volumes of the printed solid")
    volumes = phase_volumes(surface, domain)
    report_step("thickness of the printed solid")
    thickness = wall_thickness(surface, in_phase=domain.in_members)
    report_step("comparing the analysed and the printed solid")
    return PrintedBody(
        volumes_mm3=volumes,
        thickness=thickness,
        comparison=compare_bodies(analysed, surface, element, elements_mm3),
    )


def phase_volumes(
    surface: SurfaceMesh, domain: DesignDomain, samples: int = SAMPLES
) -> dict[str, float]:
    """Volume of every phase inside a closed surface, mm^3.

    Shares are counted on one random point in each of equal cubes; the sum is exact.
    """
    volume = enclosed_volume(surface)
    if domain.lattice_only:
        return {PHASES[LATTICE]: volume}
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    step = float(np.prod(upper - lower) / samples) ** (1 / 3)
    field, rng = printed_field(surface, 2 * step), np.random.default_rng(20_232)
    axes = [
        low + step * np.arange(np.ceil((high - low) / step))
        for low, high in zip(lower, upper, strict=True)
    ]
    counts = np.zeros(len(PHASES))
    for x in axes[0]:
        slab: FloatArray = np.stack(np.meshgrid([x], *axes[1:], indexing="ij")).reshape(3, -1)
        points = slab + step * rng.random(slab.shape)
        inside = points[:, field(points) < 0]
        counts += np.bincount(printed_phase_at(domain, inside), minlength=len(PHASES))
    return {
        name: float(volume * count / counts.sum())
        for name, count in zip(PHASES, counts, strict=True)
        if count
    }
