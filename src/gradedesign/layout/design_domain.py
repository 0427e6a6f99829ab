"""The design domain of a case."""

from __future__ import annotations

from gradedesign.case.generate_schema import GenerateCase
from gradedesign.case.schema import Case
from gradedesign.lattice.domain import DesignDomain, PassiveRegion
from gradedesign.part.part import Part
from gradedesign.part.signed_distance import region_distance, surface_distance


def design_domain(case: Case | GenerateCase, part: Part) -> DesignDomain:
    """The part with its signed distance, the skin and the solid regions that the case states."""
    points = part.surface.vertices
    return DesignDomain(
        distance=surface_distance(part.surface),
        lower=points.min(axis=0),
        upper=points.max(axis=0),
        skin=case.lattice.skin,
        passive=tuple(
            PassiveRegion(distance=region_distance(part.regions[k.region].corners), margin=k.margin)
            for k in case.keep
        ),
        bodies=part.report.bodies,
    )
