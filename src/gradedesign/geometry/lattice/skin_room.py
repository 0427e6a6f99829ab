"""Checks that skins have the thickness that a case states, and the part room for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.design.case.schema import Case
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.skin import skin_thickness
from gradedesign.geometry.lattice.skin_schema import SkinSpec
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.triangles.surface_mesh import corner_points

#: Places on the faces of a skin, and the seed that picks them. Any fixed seed, so that a run can be
#: repeated. Chosen, not measured.
PLACES, SEED = 20_000, 1414
#: Rounding of a formula that states its bounds itself, as clamp does.
_ROUNDING = 1e-9
#: Share of its faces below which a skin may fill the part without a word. Chosen, not measured.
_LITTLE = 0.005


def require_stated_thickness(case: Case, part: Part, spec: SkinSpec, thickness: Field) -> None:
    """Refuse a formula that leaves the stated thicknesses, on the faces or the skin's depth below.

    Parameters
    ----------
    case : Case
    part : Part
    spec : SkinSpec
    thickness : callable
        Of its formula, points ``(3, n)`` mm to ``(n,)`` mm.

    Raises
    ------
    CaseError
        Naming the value and the place.
    """
    least, most = spec.thickness
    points, inward = face_places(part, spec.faces)
    for depth in (0.0, most):
        places = points + depth * inward
        values = thickness(places)
        wrong = ~((values >= least - _ROUNDING * most) & (values <= most * (1 + _ROUNDING)))
        if wrong.any():
            at = int(np.argmax(np.where(wrong, np.abs(values - (least + most) / 2), -1.0)))
            x, y, z = places[:, at]
            raise CaseError(
                f"{case.where('lattice.skin')}: the formula {spec.formula!r} gives "
                f"{values[at]:.4g} mm at ({x:.4g}, {y:.4g}, {z:.4g}) mm; expected {least:g} to "
                f"{most:g} mm, the stated thickness, on all its faces and below them; widen it, or "
                f"write clamp(..., {least:g}, {most:g})"
            )


def require_struts(case: Case, cell: str, *, struts: bool) -> None:
    """Refuse a net-skin of a cell without struts: projected walls nearly close the surface.

    Raises
    ------
    CaseError
    """
    if not struts and any(spec.net for spec in case.lattice.skin):
        raise CaseError(
            f"{case.where('lattice.skin')}: a net-skin lays struts on the surface, and cell "
            f"'{cell}' has none; expected a strut cell such as bcc, or a skin without net"
        )


def skin_warnings(case: Case, part: Part, domain: DesignDomain) -> tuple[str, ...]:
    """Warnings on skins that meet across the part or close it, and on filled cavities."""
    warnings = [filling.note for filling in domain.fillings if filling.note]
    closed = [spec for spec in case.lattice.skin if not spec.net]
    for spec, skin in zip(closed, domain.skins, strict=True):
        if spec.follows and skin.varying is None:
            warnings.append(
                f"{case.where('lattice.skin')}: counts as {skin.thickness:g} mm, the mean of its "
                f"thickness, until the stress of the solid part is known that it follows"
            )
        points, inward = face_places(part, spec.faces)
        depth = skin_thickness(skin, points) * (1.0 if spec.faces else 2.0)
        share = float((domain.distance(points + depth * inward) > 0).mean())
        if share > _LITTLE:
            where = f"regions {', '.join(spec.faces)}" if spec.faces else "the surface"
            warnings.append(
                f"{case.where('lattice.skin')}: the part is no thicker than "
                f"{'the skin' if spec.faces else 'two skins'} of {spec.thickness[1]:g} mm below "
                f"{share:.1%} of {where}: it is solid throughout there"
            )
    if case.lattice.drain is None and any(not spec.faces for spec in closed):
        warnings.append(
            f"{case.where('lattice.skin')}: a skin on the whole surface closes the cells in: "
            f"powder or resin cannot leave them, and no mass counts it; [lattice] drain opens "
            f"them, and faces of the skin leave the others open"
        )
    return tuple(warnings)


def face_places(part: Part, faces: Sequence[str] = ()) -> tuple[FloatArray, FloatArray]:
    """Even random points on regions, or on the whole surface, and the inward normals there.

    Both ``(3, n)``, mm.
    """
    corners = (
        np.concatenate([part.regions[name].corners for name in faces])
        if faces
        else corner_points(part.surface)
    )
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    random = np.random.default_rng(SEED)
    chosen = random.choice(len(area), size=PLACES, p=area / area.sum())
    s, t = random.random((2, PLACES))
    s, t = np.where(s + t > 1, 1 - s, s), np.where(s + t > 1, 1 - t, t)
    points = a[chosen] + s[:, None] * (b - a)[chosen] + t[:, None] * (c - a)[chosen]
    # Corners, where a formula often has its largest value, as well.
    points = np.concatenate([points, corners.reshape(-1, 3)])
    unit = -normal / np.maximum(area, 1e-300)[:, None]
    return points.T, np.concatenate([unit[chosen], np.repeat(unit, 3, axis=0)]).T
