"""Growth of the printed surface by its inclination, and the volume that it adds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, enclosed_volume


@dataclass(frozen=True, slots=True, kw_only=True)
class AsBuilt:
    """Change of the volume of the printed solid by the process.

    Attributes
    ----------
    volume_change_mm3 : float
        To first order: the area of every facet times its offset.
    share : float
        Of the file's volume.
    largest_offset_mm : float
        In magnitude, on any facet.
    """

    volume_change_mm3: float
    share: float
    largest_offset_mm: float


def as_built(
    surface: SurfaceMesh, up: FloatArray, offsets: tuple[tuple[float, float], ...]
) -> AsBuilt:
    """First-order effect of offsets that depend on the inclination of the surface.

    Curvature and the closing of gaps count in the second order and are left out, so that offsets
    should be small beside walls and pores.

    Parameters
    ----------
    surface : SurfaceMesh
        Closed, outward.
    up : (3,) array
        Build direction, of length 1.
    offsets : pairs of degrees and mm
        By rising inclination: 0 looks down at the plate, 90 is a wall, 180 looks up.
    """
    vectors = area_vectors(surface)
    area = np.linalg.norm(vectors, axis=1)
    seen = area > 0
    cosine = np.clip(-(vectors[seen] @ up) / area[seen], -1.0, 1.0)
    angles, values = np.array(offsets, dtype=np.float64).T
    offset = np.interp(np.degrees(np.arccos(cosine)), angles, values)
    change = float(area[seen] @ offset)
    return AsBuilt(
        volume_change_mm3=change,
        share=change / enclosed_volume(surface),
        largest_offset_mm=float(np.abs(offset).max()),
    )
