"""Planes of symmetry on which a case models a half, a quarter or an eighth of its part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.component import SolidComponent
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.triangles.surface_mesh import area_vectors
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec, axis_prescription
from gradedesign.mechanics.fe.singular_supports import held_in_normal_alone

#: Largest distance of a region's corners from one plane, over the part's diagonal: files in single
#: precision keep a hundredth of it.
FLAT = 1e-5
#: Share of the part's face in the plane that the region must cover. Below it some of the face would
#: be free, which cannot be in a part that goes on beyond it.
COVERED = 0.999
#: Share of places near a plane that may be solid on one side and void on the other in cells that
#: count as mirrored: grid points at the very surface of a wall round either way. Chosen, not
#: measured.
ASKEW = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class SymmetryPlane:
    """A plane on which the part is mirrored."""

    region: str  #: That is held there.
    axis: int  #: 0, 1 or 2: its normal.
    at: float  #: mm. Its place along that axis.

    @property
    def words(self) -> str:
        """The plane in words: ``cut (x = 0 mm)``."""
        return f"{self.region} ({'xyz'[self.axis]} = {self.at:.4g} mm)"


def symmetry_planes(
    load_cases: Sequence[LoadCaseSpec], part: Part, where: Where
) -> tuple[SymmetryPlane, ...]:
    """Planes of symmetry that load cases state on a part.

    Raises CaseError if a region is no plane across an axis that bounds the whole part.
    """
    planes: dict[str, SymmetryPlane] = {}
    for number, spec in enumerate(load_cases):
        for place, fix in enumerate(spec.fix):
            if fix.symmetry and fix.region not in planes:
                key = where(f"load_case[{number}].fix[{place}].symmetry")
                planes[fix.region] = _plane(part, part.regions[fix.region], key)
    return tuple(planes.values())


def with_symmetry(
    load_cases: Sequence[LoadCaseSpec], part: Part, where: Where
) -> tuple[LoadCaseSpec, ...]:
    """Load cases with their planes of symmetry held in their normals.

    Raises `CaseError` as `symmetry_planes`; if a plane is not held so in every load case, if two
    are parallel, or if what acts has no mirror image.
    """
    planes = symmetry_planes(load_cases, part, where)
    _require_one_part(load_cases, part, planes, where)
    return tuple(
        spec.model_copy(update={"fix": tuple(_held(fix, planes) for fix in spec.fix)})
        for spec in load_cases
    )


def _held(fix: FixSpec, planes: Sequence[SymmetryPlane]) -> FixSpec:
    """The support with the component that symmetry holds."""
    for plane in planes:
        if fix.symmetry and fix.region == plane.region:
            held = axis_prescription("xyz"[plane.axis])
            return fix.model_copy(update={"components": held})
    return fix


def _plane(part: Part, region: Region, key: str) -> SymmetryPlane:
    """The plane of a region, if the part ends there and nowhere goes beyond."""
    corners = region.corners.reshape(-1, 3)
    axis = int(np.argmin(np.ptp(corners, axis=0)))
    off = float(np.ptp(corners[:, axis]))
    along = FixSpec(region=region.name).model_copy(
        update={"components": axis_prescription("xyz"[axis])}
    )
    if off > FLAT * part.diagonal or not held_in_normal_alone(along, region).all():
        raise CaseError(
            f"{key}: region '{region.name}' is no plane across x, y or z: its corners lie up to "
            f"{off:.3g} mm from one; expected the flat face at which the part is cut, with its "
            f"normal along an axis; turn the part, or hold it by components"
        )
    at = float(corners[:, axis].mean())
    at = 0.0 if abs(at) < FLAT * part.diagonal else at
    beyond = part.surface.vertices[:, axis] - at
    if min(beyond.max(), -beyond.min()) > FLAT * part.diagonal:
        raise CaseError(
            f"{key}: the part lies on both sides of region '{region.name}' at {'xyz'[axis]} = "
            f"{at:.4g} mm, so it is no half of a mirrored part; expected a face that bounds it"
        )
    vectors = area_vectors(part.surface)
    here = np.abs(part.surface.vertices[part.surface.faces, axis] - at).max(axis=1)
    face = np.linalg.norm(vectors[here <= FLAT * part.diagonal], axis=1).sum()
    if region.area < COVERED * face:
        raise CaseError(
            f"{key}: region '{region.name}' covers {region.area:.4g} of the {face:.4g} mm^2 that "
            f"the part has in its plane; expected all of it: the part goes on beyond a plane of "
            f"symmetry everywhere"
        )
    return SymmetryPlane(region=region.name, axis=axis, at=at)


def _require_one_part(
    load_cases: Sequence[LoadCaseSpec],
    part: Part,
    planes: Sequence[SymmetryPlane],
    where: Where,
) -> None:
    """Refuse planes that leave no one mirrored part, and loads that have no mirror image."""
    axes = [plane.axis for plane in planes]
    for number, spec in enumerate(load_cases):
        key = f"load_case[{number}]"
        held = where(f"{key}.fix")
        symmetric = {fix.region for fix in spec.fix if fix.symmetry}
        for plane in planes:
            if axes.count(plane.axis) > 1:
                raise CaseError(
                    f"{held}: two planes of symmetry across {'xyz'[plane.axis]}, so that the part "
                    f"would repeat without end; expected one; hold the other by components = "
                    f'"{"xyz"[plane.axis]}"'
                )
            if plane.region not in symmetric:
                raise CaseError(
                    f"{held}: load case '{spec.name}' does not hold region '{plane.region}' by "
                    f"symmetry, as another one does: the whole part is mirrored in all of them or "
                    f'in none; add {{region = "{plane.region}", symmetry = true}}'
                )
            _require_mirrored(part, spec, plane, where, key)


def _require_mirrored(
    part: Part, spec: LoadCaseSpec, plane: SymmetryPlane, where: Where, key: str
) -> None:
    """Refuse loads and supports that have no mirror image on a symmetry plane."""
    if spec.acceleration[plane.axis]:
        raise CaseError(
            f"{where(f'{key}.acceleration')}: found "
            f"{spec.acceleration[plane.axis] / 1e3:.4g} m/s^2 across the plane of symmetry "
            f"{plane.words}: its mirror image acts the other way, while a body accelerates as one; "
            f"expected 0 m/s^2, or the whole part"
        )
    cut = set(part.regions[plane.region].triangles.tolist())
    for place, load in enumerate(spec.load):
        if cut & set(part.regions[load.region].triangles.tolist()):
            raise CaseError(
                f"{where(f'{key}.load[{place}].region')}: region "
                f"'{load.region}' lies in the plane of symmetry {plane.words}, where the whole "
                f"part has no face; expected a load on a face that it has"
            )


def symmetry_data(planes: Sequence[SymmetryPlane], solid_mass_g: float) -> dict[str, Any]:
    """Plain data on the whole part: its planes, how often it holds the modelled one, its mass."""
    if not planes:
        return {}
    times = 2 ** len(planes)
    words = [plane.words for plane in planes]
    return {"planes": words, "copies": times, "solid_mass_g": times * solid_mass_g}


def symmetry_warnings(
    planes: Sequence[SymmetryPlane],
    solids: Sequence[SolidComponent],
    cell: Cell,
    layout: CellLayout,
) -> tuple[str, ...]:
    """Warn of cells that do not mirror on planes of symmetry, and of solids that close them."""
    told = []
    level = float(cell.level_of(float(np.mean(cell.window))))
    for plane in planes:
        near = np.abs(layout.points[plane.axis] - plane.at) < 0.5 * layout.typical
        points = layout.points[:, near]
        image = points.copy()
        image[plane.axis] = 2 * plane.at - image[plane.axis]
        inside, mirrored = (
            evaluate_shape(cell.family, cell.parameters, layout.cell_map(p)) <= level
            for p in (points, image)
        )
        share = float(np.mean(inside != mirrored)) if inside.size else 0.0
        if share > ASKEW:
            told.append(
                f"the cells do not mirror on the plane of symmetry {plane.words}: where "
                f"{cell.name} goes on beyond it {share:.0%} of places differ; what is judged is "
                f"this body with its mirror image, whose cells meet there, and no other lattice"
            )
        covering = [solid for solid in solids if solid.covers(plane.region)]
        if covering:
            told.append(
                f"{covering[0].name} closes the plane of symmetry {plane.words} too, a wall of "
                f"twice its thickness inside the whole part; [lattice] skin with faces leaves it "
                f"open"
            )
    return tuple(told)
