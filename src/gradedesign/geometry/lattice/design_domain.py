"""The design domain of a case."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import Formula, evaluate_formula, parse_formula
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.fillings import with_fillings
from gradedesign.geometry.lattice.net_skin import NetSkin
from gradedesign.geometry.lattice.passive import passive_regions
from gradedesign.geometry.lattice.skin import Skin
from gradedesign.geometry.lattice.skin_room import require_stated_thickness
from gradedesign.geometry.lattice.skin_schema import PLACE, SkinSpec
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance, surface_distance


def design_domain(case: Case, part: Part, stress: Field | None = None) -> DesignDomain:
    """The part with its signed distance, the skins and the solid regions that the case states.

    Parameters
    ----------
    case : Case
    part : Part
    stress : callable, optional
        Of points ``(3, ...)`` mm, ``(...)``, 0 to 1: what skins follow that follow the stress.
        Until it is known they have the mean of their least and largest thickness.

    Raises
    ------
    CaseError
        If the formula of a skin leaves the thicknesses that the case states, or no place of the
        part lies in a volume that stays solid, or bevel or small cavities fill the part.
    ResourceError
        If these are too small for a grid of the part.
    """
    points = part.surface.vertices
    with locating(case.where, "part"):
        distance = surface_distance(part.surface)
    domain = DesignDomain(
        distance=distance,
        lower=points.min(axis=0),
        upper=points.max(axis=0),
        skins=tuple(_skin(case, part, spec, stress) for spec in case.lattice.skin if not spec.net),
        nets=tuple(
            NetSkin(
                thickness=spec.thickness[1],
                reach=spec.net_depth or max(case.lattice.edges),
                outward=distance.outward,
                faces=_faces(part, spec),
            )
            for spec in case.lattice.skin
            if spec.net
        ),
        passive=passive_regions(case, part, distance),
        joint_radius=case.lattice.joint_radius,
        bodies=part.report.bodies,
        least_rim=(case.print and case.print.min_wall) or 0.0,
    )
    return with_fillings(case, domain)


def _skin(case: Case, part: Part, spec: SkinSpec, stress: Field | None) -> Skin:
    least, most = spec.thickness
    faces = _faces(part, spec)
    if spec.follows is not None and stress is None:
        return Skin(thickness=0.5 * (least + most), faces=faces)
    if spec.follows is not None and stress is not None:
        return Skin(
            thickness=most,
            thinnest=least,
            varying=lambda points: least + (most - least) * stress(points),
            faces=faces,
        )
    if spec.formula is None:
        return Skin(thickness=most, faces=faces)
    varying = _thickness(parse_formula(spec.formula, variables=PLACE))
    require_stated_thickness(case, part, spec, varying)
    return Skin(thickness=most, thinnest=least, varying=varying, faces=faces)


def _faces(part: Part, spec: SkinSpec) -> Field | None:
    """Distance to the faces that carry a skin, if not all do."""
    if not spec.faces:
        return None
    return region_distance(np.concatenate([part.regions[f].corners for f in spec.faces]))


def _thickness(formula: Formula) -> Field:
    def thickness(points: FloatArray) -> FloatArray:
        return evaluate_formula(formula, dict(zip(PLACE, points, strict=True)))

    return thickness
