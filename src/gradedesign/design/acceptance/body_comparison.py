"""The analysed solid beside the one that is printed: volume, topology, distance."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.acceptance.body import Body, measure_body
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, distance_within
from gradedesign.mechanics.explicit.finite_cell_fields import CONTOUR_TOLERANCE

#: Volumes that differ by more are a warning: stiffness goes at least with volume. Chosen, not
#: measured.
_VOLUME_WARNING = 0.02
#: Largest distance over the element size of the analysis beyond which something is missing, not
#: merely rounded: acute rims of gyroid sheets lay 1.3 and 1.7 elements apart (a short bar, mini).
_DISTANCE_WARNING = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyComparison:
    """Two bodies that should be one."""

    analysed: Body  #: Its surface, which finite cells contour for the purpose.
    printed: Body
    #: Largest distance of a sample of one surface to the other surface, both ways.
    distance_mm: float
    at_mm: tuple[float, float, float]  #: Where that is.
    farther: str  #: "analysed" or "printed". Body whose surface has that sample.
    mean_distance_mm: float  #: Mean over all samples.
    samples: int  #: Vertices and centroids of the triangles of both surfaces.
    element_mm: float  #: Element size of the analysis.
    elements_mm3: float  #: Solid volume of the elements of the analysis, mm^3.

    @property
    def volume_difference(self) -> float:
        """Printed volume over that of the elements of the analysis, less one."""
        return self.printed.volume_mm3 / self.elements_mm3 - 1.0

    @property
    def contour_loss(self) -> float:
        """Volume inside the analysed surface over that of the elements, less one."""
        return self.analysed.volume_mm3 / self.elements_mm3 - 1.0

    @property
    def contoured(self) -> bool:
        """Whether the analysed surface stands for the elements."""
        return abs(self.contour_loss) <= CONTOUR_TOLERANCE


def compare_bodies(
    analysed: SurfaceMesh, printed: SurfaceMesh, element: float, elements_mm3: float
) -> BodyComparison:
    """Compare two closed surfaces.

    ``element``, mm: element size of the analysis. ``elements_mm3``, mm^3: solid volume of its
    elements.
    """
    surfaces = {"analysed": analysed, "printed": printed}
    total, count = 0.0, 0
    worst, at, farther = -1.0, np.zeros(3), ""
    for (name, surface), other in zip(surfaces.items(), (printed, analysed), strict=True):
        samples = _samples(surface)
        distance = distance_within(build_triangle_tree(corner_points(other)), samples, np.inf)
        largest = int(np.argmax(distance))
        if distance[largest] > worst:
            worst, at, farther = float(distance[largest]), samples[:, largest], name
        total, count = total + float(distance.sum()), count + len(distance)
    return BodyComparison(
        analysed=measure_body(analysed),
        printed=measure_body(printed),
        distance_mm=worst,
        at_mm=(float(at[0]), float(at[1]), float(at[2])),
        farther=farther,
        mean_distance_mm=total / count,
        samples=count,
        element_mm=element,
        elements_mm3=elements_mm3,
    )


def comparison_warnings(
    comparison: BodyComparison, factors: Collection[float] = ()
) -> tuple[str, ...]:
    """Warnings of differences too large for the explicit analysis to hold for the printed file.

    ``factors``: values that acceptance found on the printed file over those of the explicit
    analysis; empty where no acceptance judged the design, so that the verdict is that of the
    analysis.
    """
    analysed, printed = comparison.analysed, comparison.printed
    found = []
    if abs(comparison.volume_difference) > _VOLUME_WARNING:
        found.append(
            f"the volume of the printed solid is {comparison.volume_difference:+.1%} off the "
            f"analysed one ({printed.volume_mm3:.6g} against {comparison.elements_mm3:.6g} mm^3, "
            f"more than {_VOLUME_WARNING:.0%})"
        )
    if not comparison.contoured:
        found.append(
            f"the surface drawn of the analysed solid is {comparison.contour_loss:+.1%} off the "
            f"volume of its elements: walls are thinner than its grid, pictures of stress and "
            f"displacement lack them, and topology and distance from the printed surface are not "
            f"compared"
        )
        return _with_meaning(found, factors)
    counts = {
        "components": (analysed.components, printed.components),
        "closed voids": (analysed.cavities, printed.cavities),
        "handles": (analysed.handles, printed.handles),
    }
    # A surface that touches itself along an edge has no countable handles: that is no difference.
    differ = [
        f"{a} {name} against {p}"
        for name, (a, p) in counts.items()
        if a is not None and p is not None and a != p
    ]
    if differ:
        found.append(
            f"the analysed solid differs in topology from the printed one: {', '.join(differ)}: "
            f"struts, windows or voids that only one of them has"
        )
    if comparison.distance_mm > _DISTANCE_WARNING * comparison.element_mm:
        x, y, z = comparison.at_mm
        found.append(
            f"the {comparison.farther} surface lies up to {comparison.distance_mm:.3g} mm from the "
            f"other, at ({x:.1f}, {y:.1f}, {z:.1f}) mm: more than {_DISTANCE_WARNING:g} elements "
            f"of {comparison.element_mm:.3g} mm, so that a strut, a wall "
            f"or an acute rim is missing in one of them"
        )
    return _with_meaning(found, factors)


def _with_meaning(found: list[str], factors: Collection[float]) -> tuple[str, ...]:
    """The last warning with what the differences mean for which values."""
    if not found:
        return ()
    if factors:
        meaning = (
            f"no value of the verdict rests on the analysed solid, all were judged on the printed "
            f"file, where the unfavourable ends of the bands are {min(factors):.3g} to "
            f"{max(factors):.3g} times the values of the explicit analysis; discrepancies of "
            f"iterations, from which sizing learns, are those of the analysed solid"
        )
    else:
        meaning = (
            "the values of the limits are those of the analysed solid, not of the printed file, "
            "and displacements are off by at least about as much as the volume"
        )
    advice = "a larger [run] elements_per_wall with more memory brings the two together"
    return (*found[:-1], f"{found[-1]}; {meaning}; {advice}")


def _samples(surface: SurfaceMesh) -> FloatArray:
    """Vertices in use and centroids of the triangles, ``(3, n)``, mm."""
    used = surface.vertices[np.unique(surface.faces)]
    return np.ascontiguousarray(
        np.concatenate([used, corner_points(surface).mean(axis=1)]).T, dtype=np.float64
    )
