"""Solid places below the skins: round inner edges, and cavities that are too small.

Both are openings of the room that skins and passive regions leave, in the words of mathematical
morphology: by a ball, and by reconstruction.

References
----------
D. Raymont, thesis, University of Exeter, section 5.2.1, opens the room on voxels.
P. Soille, Morphological Image Analysis, 2nd edition, 2003, sections 4.2 and 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import CaseError, LatticeError, ResourceError
from gradedesign.geometry.contour._surface_kernels import shell_volumes, vertex_shells
from gradedesign.geometry.contour.skin_edges import divided_skin_edges, moved_onto_skins
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.component import SKIN, SolidComponent
from gradedesign.geometry.lattice.component_kind import ComponentKind, ComponentPlace, Made
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.short_edges import used_only
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    area_vectors,
    corner_points,
    enclosed_volume,
)

#: Grid steps along the radius of a bevel, and along the diameter of the least cavity. A room of 17
#: x 9 x 9 mm with a bevel of 3 mm needs sharpened edges besides: without them it is 3.5 % too
#: small.
STEPS = 8.0
#: Most nodes of a grid. Chosen, not measured.
MOST_NODES = 3e8
#: Places on the surface of a cavity from which balls are tried, and the rounds that move the best.
#: Chosen, not measured.
_PLACES, _ROUNDS = 4000, 40
#: Share of the diameter by which a ball may be too large. Chosen, not measured.
_FITS = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Filling(SolidComponent):
    """A place below the skins that is solid because of its shape."""

    #: Points ``(3, ...)`` mm to ``(...)`` mm, negative inside, of slope one at most.
    to_place: Field

    phase: ClassVar[int] = SKIN

    def distance(self, points: FloatArray, to_part: FloatArray | None) -> FloatArray:  # noqa: ARG002
        """As stated."""
        return self.to_place(points)


def _make(place: ComponentPlace) -> Made:
    """The bevel and the small cavities that the case wants solid.

    Raises CaseError if nothing but them would be left. Raises ResourceError if they are too small
    for a grid of the part.
    """
    domain, notes = place.domain, tuple[str, ...]()
    bevel, least = place.lattice.bevel, place.lattice.least_cavity
    if bevel:
        domain = domain.with_components([_bevel(domain, bevel, place.where("lattice.bevel"))])
    if least:
        small, notes = _small(domain, least, place.where("lattice.least_cavity"))
        domain = domain.with_components([small])
    return domain.components[len(place.domain.components) :], notes


def _bevel(domain: DesignDomain, radius: float, where: str) -> Filling:
    """Points of the room that no ball of the radius inside the room reaches."""
    step = radius / STEPS
    whole = any(solid.all_round for solid in domain.solids)
    # Beyond open faces the room goes on.
    beyond = 0.0 if whole else radius + 2 * step
    lower, upper = domain.lower - beyond, domain.upper + beyond
    _require_nodes(lower, upper, step, where)
    room = _room(domain, radius + 3 * step)

    def centres(points: FloatArray) -> FloatArray:
        return radius - room(points)

    try:
        contoured = extract_surface(centres, lower, upper, step)
    except LatticeError as error:
        raise CaseError(
            f"{where}: below skins and solid regions no place was found for a ball of "
            f"{radius:g} mm radius, so all of the part would be solid; expected less"
        ) from error
    report_step("bevel below the skins")
    # A contour cuts edges off, as much as 4 % of the room of a box.
    used = np.ones(len(contoured.vertices), dtype=bool)
    vertices = moved_onto_skins(contoured.vertices, used, (centres,), centres, step)
    faces = contoured.faces.astype(np.int32)
    vertices, faces = divided_skin_edges(vertices, faces, used, (centres,), centres, step)
    away = surface_distance(SurfaceMesh(vertices=vertices, faces=faces.astype(np.int64)))
    return Filling(to_place=lambda points: radius - away(points))


def _small(domain: DesignDomain, diameter: float, where: str) -> tuple[Filling, tuple[str, ...]]:
    """Cavities that no ball of a diameter fits into, the others as they are."""
    step = diameter / STEPS
    _require_nodes(domain.lower, domain.upper, step, where)
    room = _room(domain, 3 * step)
    surface = extract_surface(lambda p: -room(p), domain.lower, domain.upper, step)
    exact = _room(domain)
    report_step("cavities below the skins")
    cavities = _cavities(surface)
    largest = [_largest_ball(cavity, exact, diameter, step) for cavity in cavities]
    fits = [ball >= diameter * (1 - _FITS) for ball in largest]
    if not any(fits):
        raise CaseError(
            f"{where}: found {diameter:g} mm, but the largest ball that fits below skins and solid "
            f"regions has {max(largest, default=0.0):.3g} mm, so all of the part would be solid; "
            f"expected less"
        )
    to_large = surface_distance(
        _together([c for c, fit in zip(cavities, fits, strict=True) if fit])
    )
    small = [cavity for cavity, fit in zip(cavities, fits, strict=True) if not fit]
    if not small:
        # Those that the grid does not show.
        return Filling(to_place=lambda points: step - to_large(points)), ()
    to_small = surface_distance(_together(small))

    def distance(points: FloatArray) -> FloatArray:
        near, away = to_small(points), to_large(points)
        # Beyond a step from what is left, and nearer to it where a small cavity is nearer still.
        return np.minimum(step - away, np.maximum(near - step, 0.5 * (near - away)))

    volume = sum(enclosed_volume(cavity) for cavity in small)
    count = f"{len(small)} {'cavity is' if len(small) == 1 else 'cavities are'}"
    note = f"{where}: {count} solid, {volume:.4g} mm^3 in all: no ball of {diameter:g} mm fits"
    return Filling(to_place=distance), (note,)


def _room(domain: DesignDomain, band: float | None = None) -> Field:
    """Distance to the solids, positive in the room that they leave."""
    # Volumes that widen beyond the part's faces would count there.
    components = tuple(
        c.within() if isinstance(c, SolidComponent) else c for c in domain.components
    )
    part, layers = solid_layers(replace(domain, components=components), band)

    def room(points: FloatArray) -> FloatArray:
        distance = part(points)
        return np.minimum.reduce([layer(points, distance) for layer in layers])

    return room


def _cavities(surface: SurfaceMesh) -> list[SurfaceMesh]:
    """Outer shells of the components of a room."""
    shell = vertex_shells(surface.faces, len(surface.vertices))
    count = int(shell.max()) + 1
    volume = shell_volumes(surface.vertices, surface.faces, shell, count)
    of_face = shell[surface.faces[:, 0]]
    return [
        used_only(surface.vertices, surface.faces, of_face == n) for n in np.flatnonzero(volume > 0)
    ]


def _together(shells: list[SurfaceMesh]) -> SurfaceMesh:
    first = np.cumsum([0, *(len(shell.vertices) for shell in shells)])
    return SurfaceMesh(
        vertices=np.concatenate([shell.vertices for shell in shells]),
        faces=np.concatenate([s.faces + n for s, n in zip(shells, first[:-1], strict=True)]),
    )


def _largest_ball(cavity: SurfaceMesh, room: Field, diameter: float, step: float) -> float:
    """Diameter of the largest ball in a cavity, mm; above ``diameter`` only a lower bound.

    A ball that fits can be moved until it touches the surface, so its centre lies half a diameter
    below a place of it. The best of such centres then climbs the distance.
    """
    normal = area_vectors(cavity)
    length = np.linalg.norm(normal, axis=1)
    every = max(len(cavity.faces) // _PLACES, 1)
    inward = -(normal / np.maximum(length, 1e-300)[:, None])[::every]
    places = corner_points(cavity).mean(axis=1)[::every]
    centres = (places + 0.5 * diameter * inward).T
    depth = room(centres)
    # Nothing of another cavity: its centre lies beyond this one's surface.
    depth[surface_distance(cavity)(centres) >= 0] = 0.0
    at, best = centres[:, int(np.argmax(depth))], float(depth.max())
    around = step * np.array(list(product((-1.0, 0.0, 1.0), repeat=3))).T
    for _ in range(_ROUNDS if 0 < 2 * best < diameter else 0):
        tried = at[:, None] + around
        depth = room(tried)
        if depth.max() > best:
            at, best = tried[:, int(np.argmax(depth))], float(depth.max())
        else:
            around = 0.5 * around
    return 2 * best


def _require_nodes(lower: FloatArray, upper: FloatArray, step: float, where: str) -> None:
    nodes = float(np.prod((upper - lower) / step + 2.0))
    if nodes > MOST_NODES:
        raise ResourceError(
            f"{where}: is found on a grid of {step:.3g} mm, an eighth of it, which takes "
            f"{nodes:.2g} nodes; expected at most {MOST_NODES:.2g}: state a larger one"
        )


#: Solid places below skins, ``bevel = "0.5 mm"`` and ``least_cavity = "1 mm"``.
KIND = ComponentKind(name="filling", stage="filling", make=_make)
