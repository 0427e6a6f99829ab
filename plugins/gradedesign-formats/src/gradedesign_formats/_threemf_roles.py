"""Role of each object, component and build item of a 3MF file, from all that states it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NoReturn

from gradedesign import PartError
from gradedesign_formats._threemf_id import ResourceId
from gradedesign_formats._threemf_metadata import SOLID, SlicerMetadata, StatedBody
from gradedesign_formats._threemf_model import ThreemfModel
from gradedesign_formats._threemf_object import ThreemfItem, ThreemfMarks, ThreemfObject

#: Role of what the slicer is told to leave on the plate.
_NOT_PRINTABLE = "not printable"
#: Type of the core specification that slicers give to every body that is no solid.
_OTHER = "other"


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyRole:
    """Name and role of an object where it is placed.

    Attributes
    ----------
    name : str or None
        As the file names it.
    role : str
        ``solid``, or one of those of `gradedesign.FileBody`.
    """

    name: str | None
    role: str


class ThreemfRoles:
    """Roles by a model and the metadata beside it, which must not contradict each other.

    Raises
    ------
    PartError
        If metadata tells of what the model does not have.
    """

    def __init__(self, model: ThreemfModel, metadata: SlicerMetadata) -> None:
        self._model, self._metadata = model, metadata
        self._parts: dict[ResourceId, dict[ResourceId, StatedBody]] = {}
        for number, where in metadata.where.items():
            if number not in model.objects:
                self._refuse(
                    f"{where} tells of object {number}, which the model does not have; save the "
                    "file again in the slicer"
                )
            self._parts[number] = self._components(number, model.objects[number])

    def of_item(self, item: ThreemfItem) -> BodyRole:
        """Role of a build item."""
        return self._settled(item.number, item.number, (item.marks,))

    def of_component(self, parent: ResourceId, number: ResourceId) -> BodyRole:
        """Role of an object as a component of another."""
        return self._settled(parent, number, ())

    def unstated(self, number: ResourceId) -> list[str]:
        """Components or ranges without a role, of an object that metadata divides into several."""
        part, parts = self._model.objects[number], self._parts.get(number, {})
        inner = dict.fromkeys(inner for inner, _ in part.components) if parts else {}
        bodies = {f"object {n}, a component of {part.marks.label}": parts.get(n) for n in inner}
        if not part.components:
            bodies = {body.label: body for body in self._metadata.volumes.get(number, ())}
        if len(bodies) < 2:
            return []
        return [label for label, body in bodies.items() if body is None or body.role is None]

    def volumes(self, number: ResourceId) -> Sequence[StatedBody]:
        """Ranges of the triangles of a mesh in their order; none where it is one body.

        Raises
        ------
        PartError
            If they overlap, lie outside of the mesh, or leave triangles out.
        """
        part = self._model.objects[number]
        found = [*self._metadata.volumes.get(number, ()), *part.volumes]
        if not found:
            return ()
        count = len(part.colors)
        for body in found:
            if body.first > body.last or body.last >= count:
                self._refuse_volume(
                    body, f"which lie outside: {count} triangles are there, counted from 0"
                )
        ordered = sorted(found, key=lambda body: body.first)
        for before, after in pairwise(ordered):
            if after.first <= before.last:
                self._refuse_volume(
                    after, f"some of which {before.label} has as well ({before.where})"
                )
        ends = [-1, *(body.last for body in ordered)]
        starts = [*(body.first for body in ordered), count]
        for end, start in zip(ends, starts, strict=True):
            if start != end + 1:
                self._refuse(
                    f"{found[0].where} names volumes of {part.marks.label}, but triangles "
                    f"{end + 1} to {start - 1} are in none; save the file again in the slicer"
                )
        return found

    def _components(self, number: ResourceId, part: ThreemfObject) -> dict[ResourceId, StatedBody]:
        """Parts by component, each of one; refuse ranges of triangles of an assembly."""
        inner = dict.fromkeys(n for n, _ in part.components) or {number: None}
        found = {}
        for stated, body in self._metadata.parts.get(number, {}).items():
            fits = [other for other in inner if other.number == stated]
            if len(fits) != 1:
                why = "no such component" if not fits else f"{len(fits)} such components"
                listed = ", ".join(sorted(map(str, fits or inner))[:12])
                self._refuse(
                    f"{body.where} tells of {body.label}, which has {why}; found {listed}: save "
                    "the file again in the slicer"
                )
            found[fits[0]] = body
        for body in self._metadata.volumes.get(number, ()) if part.components else ():
            if body.role not in (None, SOLID):
                self._refuse_volume(body, "which has components instead of triangles")
        return found

    def _settled(
        self, parent: ResourceId, number: ResourceId, marks: tuple[ThreemfMarks, ...]
    ) -> BodyRole:
        """The one role that all agree on."""
        part = self._model.objects.get(number)
        if part is None:  # refused where it is placed
            return BodyRole(name=None, role=SOLID)
        marks = (*marks, part.marks)
        tables = [self._parts.get(owner, {}) for owner in dict.fromkeys((parent, number))]
        bodies = [table[number] for table in tables if number in table]
        stated = {body.role: body.where for body in reversed(bodies) if body.role is not None}
        for mark in marks:
            for role in (role for role, holds in mark.roles.items() if holds):
                stated.setdefault(role, f"metadata of {mark.label}")
        if not part.components:  # the core specification ignores the type of an assembly
            # Slicers give this type to all that is no solid.
            if part.kind != "model" and not (part.kind == _OTHER and stated.keys() - {SOLID}):
                stated.setdefault(f"object of type {part.kind}", "its type")
            volumes = (*self._metadata.volumes.get(number, ()), *part.volumes)
            for body in volumes if stated.keys() - {SOLID} else ():
                stated.setdefault(body.role or SOLID, body.where)
        if len(stated) > 1:
            listed = " and ".join(f"{role} ({where})" for role, where in stated.items())
            self._refuse(
                f"{part.marks.label} has {len(stated)} roles: {listed}; keep one of them in the "
                "slicer"
            )
        names = [body.name for body in bodies] + [self._metadata.names.get(number), part.name]
        printable = all(mark.printable for mark in marks)
        return BodyRole(
            name=next((name for name in names if name), None),
            role=next(iter(stated), SOLID) if printable else _NOT_PRINTABLE,
        )

    def _refuse_volume(self, body: StatedBody, why: str) -> NoReturn:
        self._refuse(
            f"{body.where} tells of {body.label}, {why}; save the file again in the slicer"
        )

    def _refuse(self, why: str) -> NoReturn:
        raise PartError(f"{self._model.source}: {why}")
