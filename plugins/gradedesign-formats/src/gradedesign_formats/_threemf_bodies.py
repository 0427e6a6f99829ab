"""Solids that a 3MF file builds, where they are placed, with its negative volumes subtracted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gradedesign import (
    Cutter,
    FileBody,
    PartError,
    PlacedBody,
    closed_body,
    cut_together,
    meet,
    without_cutters,
)
from gradedesign.fields import FloatArray
from gradedesign_formats._threemf_id import ResourceId
from gradedesign_formats._threemf_metadata import SOLID
from gradedesign_formats._threemf_model import ThreemfModel
from gradedesign_formats._threemf_object import ThreemfObject
from gradedesign_formats._threemf_roles import BodyRole, ThreemfRoles

#: Components in components no deeper than this. Chosen, not measured.
_DEEPEST = 32
#: Where all components are placed, no more meshes and triangles than these. Chosen, not measured.
_MOST_MESHES, _MOST_TRIANGLES = 100_000, 20_000_000
#: Objects that a message lists; chosen, not measured.
_LISTED = 12
#: Pairs of a solid and a negative volume whose boxes meet; chosen, not measured.
_MOST_CUTS = 10_000


@dataclass(slots=True, kw_only=True, eq=False)
class BodyReader:
    """Builds the bodies of a 3MF model from its items.

    Attributes
    ----------
    scale : float, mm
        A unit of the model.
    found : list of FileBody
        Bodies that are subtracted or left out so far.
    notes : list of str
        Remarks for the user.
    names, colors : dict of int to str
        Of the faces so far.
    """

    model: ThreemfModel
    roles: ThreemfRoles
    scale: float
    found: list[FileBody] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    colors: dict[int, str] = field(default_factory=dict)
    face_count: int = 0
    _meshes: int = 0
    _triangles: int = 0
    _cuts: int = 0
    _cutting: set[int] = field(default_factory=set)

    def bodies(self) -> list[PlacedBody]:
        """Solids of all build items, cut.

        Raises
        ------
        PartError
            If objects are missing, too many, or contradict each other in their roles; if all is
            left out or cut away; if a body that is to be cut is damaged.
        """
        if self.model.objects and not self.model.items:
            listed = ", ".join(
                f"{part.marks.label} of type {part.kind}"
                for part in list(self.model.objects.values())[:_LISTED]
            )
            raise PartError(
                f"{self.model.source}: nothing is to be built: its <build> names none of the "
                f"{len(self.model.objects)} objects in it ({listed}); export the part again as a "
                "solid"
            )
        whole: list[PlacedBody] = []
        for item in self.model.items:
            role = self.roles.of_item(item)
            whole += self._joined([], role, item.number, item.place, role.name, 0, used=True)
        bodies = self._finished(whole)
        names = list(dict.fromkeys(map(str, self.found)))
        if not bodies and names:
            raise PartError(
                f"{self.model.source}: no solid is left beside {', '.join(names[:_LISTED])}; "
                "export the solid too, or change in the slicer what these are and where they cut"
            )
        for number, body in enumerate(self.found):
            if body.role == FileBody.NEGATIVE and number not in self._cutting:
                self.notes.append(
                    f"{self.model.source}: the negative volume '{body.name}' takes nothing away "
                    "from what stands before it in its object; check its place and the order"
                )
        return bodies

    def _joined(
        self,
        before: list[PlacedBody],
        role: BodyRole,
        number: ResourceId,
        place: FloatArray,
        name: str | None,
        depth: int,
        *,
        used: bool,
    ) -> list[PlacedBody]:
        """Add an object to the solids so far, subtract it from them, or leave it out."""
        taken = used and role.role in (SOLID, FileBody.NEGATIVE)
        new = self._object(number, place, name, depth, used=taken)
        of_assembly = "" if name is None else f" of {name}"
        called = role.name or f"object {number}{of_assembly}"
        return self._with(before, role, new, called) if used else before

    def _with(
        self, before: list[PlacedBody], role: BodyRole, new: list[PlacedBody], name: str
    ) -> list[PlacedBody]:
        if role.role == SOLID:
            return before + new
        self.found.append(FileBody(name=name, role=role.role))
        if role.role != FileBody.NEGATIVE:
            return before
        cutters = []
        for body in self._finished(new):
            source = f"{self.model.source}, the negative volume '{name}'"
            closed, notes = closed_body(body, self.scale, source)
            cutters.append(Cutter(number=len(self.found) - 1, body=body, closed=closed))
            self.notes += notes
        hit = [body for body in before if any(meet(body, cutter.body) for cutter in cutters)]
        apart = [body for body in before if not any(body is other for other in hit)]
        if len(hit) > 1:  # those that overlap would keep common faces if they were cut one by one
            hit = self._finished(hit)
        return [*apart, cut_together(hit, cutters)] if hit else apart

    def _object(
        self, number: ResourceId, place: FloatArray, name: str | None, depth: int, *, used: bool
    ) -> list[PlacedBody]:
        """Solids of an object; none where it is not used."""
        part = self.model.objects.get(number)
        source = self.model.source
        if part is None:
            raise PartError(f"{source}: object {number} is missing; export it again")
        if depth > _DEEPEST:
            raise PartError(
                f"{source}: components of object {number} are nested more than {_DEEPEST} deep, or "
                "contain themselves; export the part as one object"
            )
        self.notes += [
            f"{source}: the slicer's metadata gives {label} no role; it is taken as solid"
            for label in (self.roles.unstated(number) if used else ())
        ]
        if not part.components:
            return self._mesh(number, part, place, name, used=used)
        if used and part.kind != "model":
            self.notes.append(
                f"{source}: {part.marks.label} has the type {part.kind}, which the 3MF core "
                "specification ignores for assemblies; its components count by their own types"
            )
        bodies: list[PlacedBody] = []
        for inner, matrix in part.components:
            turned = matrix @ place[:3]
            turned[3] += place[3]
            role = self.roles.of_component(number, inner)
            own = role.name or name
            bodies = self._joined(bodies, role, inner, turned, own, depth + 1, used=used)
        return bodies

    def _mesh(
        self,
        number: ResourceId,
        part: ThreemfObject,
        place: FloatArray,
        name: str | None,
        *,
        used: bool,
    ) -> list[PlacedBody]:
        """Solids of a mesh, of which a slicer may name ranges."""
        self._meshes, self._triangles = self._meshes + 1, self._triangles + len(part.colors)
        if self._meshes > _MOST_MESHES or self._triangles > _MOST_TRIANGLES:
            raise PartError(
                f"{self.model.source}: more than {_MOST_MESHES} meshes or {_MOST_TRIANGLES} "
                "triangles where all components are placed; export one part, or coarser"
            )
        if not used:
            return []
        if not part.colors:
            raise PartError(
                f"{self.model.source}: {part.marks.label} of type {part.kind} has no triangles; "
                "export it again as a solid"
            )
        corners = _corners(part, place)
        shades = {
            reference: self.model.color(reference) for reference in dict.fromkeys(part.colors)
        }
        volumes = self.roles.volumes(number)
        if not volumes:
            every = slice(0, len(corners))
            return [self._body(name or f"object {number}", name, corners, part, shades, every)]
        bodies: list[PlacedBody] = []
        for volume in volumes:
            role = BodyRole(name=volume.name or name, role=volume.role or SOLID)
            called, new = role.name or volume.label, []
            if role.role in (SOLID, FileBody.NEGATIVE):
                some = slice(volume.first, volume.last + 1)
                new = [self._body(called, role.name, corners, part, shades, some)]
            bodies = self._with(bodies, role, new, called)
        return bodies

    def _body(
        self,
        name: str,
        label: str | None,
        corners: FloatArray,
        part: ThreemfObject,
        shades: dict[tuple[ResourceId, str] | None, str | None],
        some: slice,
    ) -> PlacedBody:
        """Some triangles of a mesh, each colour a face of its own."""
        own = [shades[reference] for reference in part.colors[some]]
        numbers = {shade: self.face_count + k for k, shade in enumerate(dict.fromkeys(own))}
        self.face_count += len(numbers)
        self.names |= {k: label for k in numbers.values() if label is not None}
        self.colors |= {k: shade for shade, k in numbers.items() if shade is not None}
        of_triangle = np.array([numbers[shade] for shade in own], dtype=np.int64)
        return PlacedBody(name=name, corners=corners[some], label=of_triangle)

    def _finished(self, bodies: Sequence[PlacedBody]) -> list[PlacedBody]:
        """Solids without their negative volumes, and without those that are cut away."""
        rest = [body if not body.cutters else self._cut(body) for body in bodies]
        return [body for body in rest if body is not None]

    def _cut(self, body: PlacedBody) -> PlacedBody | None:
        """A solid without its negative volumes; None where nothing is left."""
        self._cuts += len(body.cutters)
        if self._cuts > _MOST_CUTS:
            raise PartError(
                f"{self.model.source}: more than {_MOST_CUTS} cuts by negative volumes; apply them "
                "in the slicer or in CAD, and export the result"
            )
        rest, cutting, notes = without_cutters(body, self.scale, self.model.source)
        self._cutting |= cutting
        self.notes += notes
        return rest


def _corners(part: ThreemfObject, place: FloatArray) -> FloatArray:
    """Corners ``(m, 3, 3)`` of a mesh where it is placed; a mirrored one stays outward."""
    vertices = np.array(part.vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(part.triangles, dtype=np.int64).reshape(-1, 3)
    if np.linalg.det(place[:3]) < 0.0:
        triangles = triangles[:, ::-1]
    return np.asarray((vertices @ place[:3] + place[3])[triangles])
