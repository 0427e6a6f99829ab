"""Roles that slicers write beside the model of a 3MF file, gathered as the elements arrive.

PrusaSlicer and its kin name ranges of an object's triangles (``volume``), Bambu Studio and
OrcaSlicer components of an object (``part``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NoReturn

from gradedesign import FileBody, PartError
from gradedesign_formats._threemf_id import ResourceId

#: Roles that more than one format knows.
SOLID, MODIFIER = "solid", "parameter modifier"
#: Endings of the entries that hold roles; other entries of ``Metadata`` hold settings of printing.
_ENTRIES = ("_model.config", "model_settings.config")
_VOLUME_TYPES = {
    "ModelPart": SOLID,
    "NegativeVolume": FileBody.NEGATIVE,
    "ParameterModifier": MODIFIER,
    "SupportEnforcer": "support enforcer",
    "SupportBlocker": "support blocker",
}
_SUBTYPES = {
    "normal_part": SOLID,
    "negative_part": FileBody.NEGATIVE,
    "modifier_part": MODIFIER,
    "support_enforcer": "support enforcer",
    "support_blocker": "support blocker",
}
_WHOLE = re.compile(r"\d{1,9}")


@dataclass(slots=True, kw_only=True)
class StatedBody:
    """A range of an object's triangles, or a component of it, with what is stated of it.

    Attributes
    ----------
    where : str
        Entry of the package, for messages.
    label : str
        What it is, for messages.
    name, role : str or None
        None where none is stated.
    first, last : int
        Triangles, both included; of a range only.
    """

    where: str
    label: str
    name: str | None = None
    role: str | None = None
    first: int = 0
    last: int = -1

    def state(self, role: str, source: str) -> None:
        """Record a role; refuse a second one that differs."""
        if self.role not in (None, role):
            raise PartError(
                f"{source}: {self.where} gives {self.label} two roles, {self.role} and {role}; "
                "save the file again in the slicer"
            )
        self.role = role


class SlicerMetadata:
    """Ranges and components with roles, by object of the root model.

    Attributes
    ----------
    source : str
        Name of the file, for messages.
    volumes : dict of ResourceId to list of StatedBody
        Ranges of the triangles of each object, in their order.
    parts : dict of ResourceId to dict of str to StatedBody
        Components of each object by the number of the object that they place, which metadata
        states without its model.
    names : dict of ResourceId to str
        Names of objects.
    where : dict of ResourceId to str
        Entry that tells of each object.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.volumes: dict[ResourceId, list[StatedBody]] = {}
        self.parts: dict[ResourceId, dict[str, StatedBody]] = {}
        self.names: dict[ResourceId, str] = {}
        self.where: dict[ResourceId, str] = {}
        self._entry = ""
        self._path: list[str] = []
        self._object = ResourceId("")
        self._body: StatedBody | None = None

    def handler(self, entry: str) -> SlicerMetadata | None:
        """Take an entry of the package next, if it holds roles."""
        if not entry.lower().startswith("metadata/") or not entry.lower().endswith(_ENTRIES):
            return None
        self._entry, self._path, self._body = entry, [], None
        return self

    def prefix(self, prefix: str, namespace: str) -> None:
        """Pass over a namespace: roles are in none."""

    def text(self, data: str) -> None:
        """Pass over text: roles are attributes."""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Take one element."""
        within, key = self._path == ["config", "object"], attributes.get("key", "")
        self._path.append(name)
        if self._path == ["config", "object"]:
            self._object = ResourceId(self._attribute(attributes, "id", "an object"))
            self.where[self._object] = self._entry
        elif within and name == "volume":
            self._begin_volume(attributes)
        elif within and name == "part":
            self._begin_part(attributes)
        elif key == "volume_type" and self._body is None:
            self._refuse_place(f"a {key}")
        elif "firstid" in attributes or "subtype" in attributes:
            self._refuse_place(f"a '{name[:40]}'")
        elif name == "metadata" and self._path[:2] == ["config", "object"]:
            self._state(key, attributes.get("value", "").strip())

    def end(self, name: str) -> None:
        """Close an element."""
        self._path.pop()
        if name in ("volume", "part"):
            self._body = None

    def _begin_volume(self, attributes: dict[str, str]) -> None:
        label = f"a volume of object {self._object}"
        first, last = (
            whole_number(
                self._attribute(attributes, key, label),
                f"{key} of {label}",
                self._entry,
                self.source,
            )
            for key in ("firstid", "lastid")
        )
        label = f"the volume of triangles {first} to {last} of object {self._object}"
        self._body = StatedBody(where=self._entry, label=label, first=first, last=last)
        self.volumes.setdefault(self._object, []).append(self._body)

    def _begin_part(self, attributes: dict[str, str]) -> None:
        number = self._attribute(attributes, "id", f"a part of object {self._object}")
        label = f"part {number} of object {self._object}"
        parts = self.parts.setdefault(self._object, {})
        self._body = parts.setdefault(number, StatedBody(where=self._entry, label=label))
        if "subtype" in attributes:
            self._body.state(self._known("subtype", attributes["subtype"], _SUBTYPES), self.source)

    def _state(self, key: str, value: str) -> None:
        """Take a value that is stated of the open volume, part or object."""
        if self._body is None:
            if key == "name" and len(self._path) == 3 and value:
                self.names[self._object] = value
        elif key == "name":
            self._body.name = value or None
        elif key == "volume_type":
            self._body.state(self._known(key, value, _VOLUME_TYPES), self.source)
        elif key == "modifier":  # of versions that knew no other role
            role = self._known(key, value, {"0": "", "1": MODIFIER})
            if role:
                self._body.state(role, self.source)

    def _known(self, key: str, value: str, roles: Mapping[str, str]) -> str:
        if value not in roles:
            label = f"object {self._object}" if self._body is None else self._body.label
            self._refuse(
                f"{self._entry} gives {label} the {key} {value[:40]!r}, which is unknown; expected "
                f"one of {', '.join(roles)}: change it in the slicer, or export the part as STL"
            )
        return roles[value]

    def _attribute(self, attributes: dict[str, str], key: str, label: str) -> str:
        if key not in attributes:
            self._refuse(f"{self._entry}: {label} lacks its {key}; save the file again")
        return attributes[key]

    def _refuse_place(self, what: str) -> NoReturn:
        where = "/".join(self._path[:-1])[-80:]
        self._refuse(
            f"{self._entry} has {what} in '{where}', whose role is unknown; expected volumes or "
            "parts of objects: save the file again in the slicer, or export the part as STL"
        )

    def _refuse(self, why: str) -> NoReturn:
        raise PartError(f"{self.source}: {why}")


def whole_number(text: str, label: str, where: str, source: str) -> int:
    """An index of metadata."""
    if not _WHOLE.fullmatch(text.strip()):
        raise PartError(
            f"{source}: {where} has {text[:40]!r} as {label}; expected a whole number: save the "
            "file again in the slicer"
        )
    return int(text)
