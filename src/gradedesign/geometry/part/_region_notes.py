"""Warnings about regions that were found, but may hold more than their keys say."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.part.regions_schema import RegionSpec

#: A surface that makes this angle with ``facing`` is a side and no longer the face that was meant,
#: degrees; more than the 45 degrees at which a rounded edge ends and its neighbour begins.
_TURNED_AWAY = 60.0
#: Share of a region's area that may be turned away without a word, as rounded rims are. Chosen, not
#: measured.
_TURNED_SHARE = 0.05


def region_notes(regions: Mapping[str, Region], specs: Mapping[str, RegionSpec]) -> list[str]:
    """Warn of regions chosen by ``facing`` of whose area a part faces elsewhere.

    ``facing`` compares the mean normal of a smooth face. A face that runs on around an edge, as
    faces of scans and of rounded solids do, fits by its mean and brings its sides along.
    """
    notes = []
    for name, region in regions.items():
        spec = specs[name]
        if spec.facing_vector is None:
            continue
        away = _turned_share(region, np.array(spec.facing_vector))
        if away > _TURNED_SHARE:
            notes.append(
                f"region.{name}: {100.0 * away:.0f} % of its {region.area:.4g} mm^2 is turned more "
                f"than {_TURNED_AWAY:g} deg away from {spec.facing}: the smooth face curves away "
                "or runs on around an edge; if only its front is meant, cut it out by a box with "
                "clip = true"
            )
    return notes


def _turned_share(region: Region, vector: FloatArray) -> float:
    """Share of a region's area whose normal is turned away from a unit vector."""
    a, b, c = np.moveaxis(region.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    twice = np.linalg.norm(normal, axis=1)
    away = normal @ vector < np.cos(np.radians(_TURNED_AWAY)) * twice
    return float(twice[away].sum() / twice.sum())
