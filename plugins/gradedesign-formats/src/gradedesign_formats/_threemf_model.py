"""Objects, colours, roles and build items of a 3MF file's models, gathered as elements arrive."""

from __future__ import annotations

import re
from typing import NoReturn

import numpy as np

from gradedesign import PartError
from gradedesign.fields import FloatArray
from gradedesign_formats import _threemf_namespaces as ns
from gradedesign_formats._threemf_id import ResourceId
from gradedesign_formats._threemf_metadata import MODIFIER, SOLID, StatedBody, whole_number
from gradedesign_formats._threemf_object import ThreemfItem, ThreemfMarks, ThreemfObject
from gradedesign_formats._threemf_package import entry_name

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_WHOLE = re.compile(r"\d{1,9}")
_COLOR = re.compile(r"#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?")
_IDENTITY = "1 0 0 0 1 0 0 0 1 0 0 0"
_GROUPS = (ns.CORE + "basematerials", ns.MATERIAL + "colorgroup")
#: Types of objects that the core specification knows.
_KINDS = ("model", "solidsupport", "support", "surface", "other")
#: Roles that Cura knows, by the name of the metadata that gives them.
_CURA_ROLES = {
    "infill_mesh": "infill mesh",
    "cutting_mesh": "cutting mesh",
    "anti_overhang_mesh": "anti-overhang mesh",
    "support_mesh": "support mesh",
}
#: Of the object itself, where a file holds other resolutions of it.
_FULL = "fullres"
_SWITCH = {"true": True, "1": True, "false": False, "0": False}


class ThreemfModel:
    """The models of a file as far as they have been parsed: the root model, and those it places.

    Source: 3MF Core Specification 1.4; 3MF Production Extension 1.2, chapters 2 and 3.

    Attributes
    ----------
    source : str
        Name of the file, for messages.
    unit : str
        As the file says.
    objects : dict of ResourceId to ThreemfObject
    items : list of ThreemfItem
        Of the root model; those of others do not count.
    placed : dict of str to None
        Entries with the other models of which the root model places objects, in their order.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.unit = ""
        self.objects: dict[ResourceId, ThreemfObject] = {}
        self.items: list[ThreemfItem] = []
        self.placed: dict[str, None] = {}
        self._colors: dict[ResourceId, list[str | None]] = {}
        self._root: str | None = None
        self._begin_entry("")

    def handler(self, entry: str) -> ThreemfModel:
        """Take an entry of the package next; the first one is the root model."""
        if self._root is None:
            self._root = entry
        self._begin_entry("" if entry == self._root else entry)
        return self

    def _begin_entry(self, entry: str) -> None:
        self._entry, self._begun = entry, False
        self._group: list[str | None] = []
        self._open: ThreemfObject | None = None
        self._namespaces: dict[str, str] = {}
        self._marks: ThreemfMarks | None = None
        self._key: str | None = None
        self._words: list[str] = []
        self._ids: dict[str, ResourceId] = {}

    def prefix(self, prefix: str, namespace: str) -> None:
        """Remember a prefix: required extensions are named by it."""
        self._namespaces[prefix] = namespace + "}"

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Take one element; elements of extensions that are not required are passed over."""
        if name == ns.CORE + "vertex":
            numbers = [self._number(self._text(attributes, axis)) for axis in "xyz"]
            self._object(name).vertices.extend(numbers)
        elif name == ns.CORE + "triangle":
            self._triangle(self._object(name), attributes)
        elif name == ns.CORE + "model":
            self._begin(attributes)
        elif not self._begun:
            self._refuse("its model is not of 3MF's core specification; export it again as 3MF")
        elif name == ns.CORE + "object":
            self._begin_object(attributes)
        elif name == ns.CORE + "component":
            self._object(name).components.append(self._placed(attributes))
        elif name == ns.CORE + "item":
            self._begin_item(attributes)
        elif name in _GROUPS:
            self._group = self._colors.setdefault(self._id(self._text(attributes, "id")), [])
        elif name in (ns.CORE + "base", ns.MATERIAL + "color"):
            text = attributes.get("displaycolor", attributes.get("color", ""))
            self._group.append(text[:7].lower() if _COLOR.fullmatch(text) else None)
        elif self._marks is not None:
            self._begin_mark(name, attributes)

    def text(self, data: str) -> None:
        """Gather the value of metadata."""
        if self._key is not None:
            self._words.append(data)

    def end(self, name: str) -> None:
        """Close an object, a build item or a piece of metadata."""
        if name == ns.CORE + "object":
            self._open = self._marks = None
        elif name == ns.CORE + "item":
            self._marks = None
        elif self._key is not None and name in (ns.CORE + "metadata", ns.CURA + "setting"):
            self._end_mark(self._key, "".join(self._words).strip())
            self._key = None

    def color(self, reference: tuple[ResourceId, str] | None) -> str | None:
        """Colour ``#rrggbb`` of a group and an index; None where the group holds no colours."""
        if reference is None or reference[0] not in self._colors:
            return None
        group, index = self._colors[reference[0]], self._whole(reference[1])
        if index >= len(group):
            self._refuse(f"colour {index} of group {reference[0]} is missing; export it again")
        return group[index]

    def _begin(self, attributes: dict[str, str]) -> None:
        self._begun, unit = True, attributes.get("unit", "millimeter")
        self.unit = self.unit or unit
        if unit != self.unit:
            self._refuse(
                f"its unit is {unit!r}, that of the root model {self.unit!r}; expected one unit: "
                "export it again"
            )
        for prefix in attributes.get("requiredextensions", "").split():
            namespace = self._namespaces.get(prefix, "")
            if namespace not in (ns.CORE, ns.MATERIAL, ns.PRODUCTION):
                self._refuse(
                    f"needs the {ns.EXTENSIONS.get(namespace, prefix)} extension of 3MF, which is "
                    "not read; export the part as plain 3MF (core specification), STL or STEP"
                )

    def _begin_object(self, attributes: dict[str, str]) -> None:
        number = self._id(self._text(attributes, "id"))
        if number in self.objects or self._open is not None:
            self._refuse(f"object {number} is there twice, or inside another; export it again")
        color = None
        if "pid" in attributes:
            color = self._id(attributes["pid"]), attributes.get("pindex", "0")
        name = attributes.get("name", "").strip() or None
        label = f"object {number}" + ("" if name is None else f" '{name}'")
        kind = attributes.get("type", _KINDS[0])
        if kind not in _KINDS:
            self._refuse(
                f"{label} has the type {kind[:40]!r}, which is unknown; expected one of "
                f"{', '.join(_KINDS)}: export it again"
            )
        resolution = attributes.get(ns.ALTERNATIVES + "modelresolution", _FULL)
        if resolution != _FULL:
            self._refuse(
                f"{label} has the modelresolution {resolution[:40]!r}: it stands for another shape;"
                f" expected {_FULL}: export the part itself"
            )
        self._marks = ThreemfMarks(label=label, printable=self._printable(attributes, label))
        self._open = self.objects[number] = ThreemfObject(
            kind=kind, name=name, color=color, marks=self._marks
        )

    def _begin_item(self, attributes: dict[str, str]) -> None:
        if self._entry:  # the root model alone says what is built
            return
        number, place = self._placed(attributes)
        label = f"item {len(self.items) + 1} (object {number})"
        self._marks = ThreemfMarks(label=label, printable=self._printable(attributes, label))
        self.items.append(ThreemfItem(number=number, place=place, marks=self._marks))

    def _printable(self, attributes: dict[str, str], label: str) -> bool:
        return self._switch(attributes.get("printable", "1"), f"printable of {label}")

    def _switch(self, text: str, label: str) -> bool:
        if text.strip().lower() not in _SWITCH:
            self._refuse(
                f"found {text[:40]!r} as {label}; expected one of {', '.join(_SWITCH)}: save the "
                "file again in the slicer"
            )
        return _SWITCH[text.strip().lower()]

    def _begin_mark(self, name: str, attributes: dict[str, str]) -> None:
        """Take an element about the open object or item: metadata, or a volume of Slic3r."""
        if name == ns.CORE + "metadata":
            prefix, _, key = attributes.get("name", "").partition(":")
            known = self._namespaces.get(prefix, ns.CURA if prefix == "cura" else None)
            if known == ns.CURA:
                self._key, self._words = key, []
        elif name == ns.CURA + "setting":
            self._key, self._words = attributes.get("key", ""), []
        elif name.endswith("}volume") and "ts" in attributes and self._open is not None:
            where, label = "its model", f"a volume of {self._open.marks.label}"
            first, last = (
                whole_number(self._text(attributes, key), f"{key} of {label}", where, self.source)
                for key in ("ts", "te")
            )
            label = f"the volume of triangles {first} to {last} of {self._open.marks.label}"
            modifier = self._switch(attributes.get("modifier", "0"), f"modifier of {label}")
            role = MODIFIER if modifier else SOLID
            self._open.volumes.append(
                StatedBody(where=where, label=label, role=role, first=first, last=last)
            )

    def _end_mark(self, key: str, value: str) -> None:
        """Take Cura's metadata about the role of the open object or item."""
        if self._marks is None or not key.endswith("_mesh"):
            return
        holds = self._switch(value, f"cura:{key} of {self._marks.label}")
        if holds and key not in _CURA_ROLES:
            self._refuse(
                f"{self._marks.label} has the metadata cura:{key}, which is unknown; expected one "
                f"of {', '.join(_CURA_ROLES)}: change it in the slicer, or export the part as STL"
            )
        if self._marks.roles.setdefault(_CURA_ROLES.get(key, key), holds) != holds:
            self._refuse(
                f"{self._marks.label} has the metadata cura:{key} twice, once True and once "
                "False; save the file again in the slicer"
            )

    def _triangle(self, part: ThreemfObject, attributes: dict[str, str]) -> None:
        corners = [self._whole(self._text(attributes, key)) for key in ("v1", "v2", "v3")]
        if max(corners) >= len(part.vertices) // 3:
            self._refuse(
                f"triangle {len(part.colors)} uses vertex {max(corners)}, "
                f"{len(part.vertices) // 3} are there; export or copy the file again"
            )
        part.triangles.extend(corners)
        color = part.color
        if "p1" in attributes:
            inherited = self._id("") if part.color is None else part.color[0]
            group = self._id(attributes["pid"]) if "pid" in attributes else inherited
            first = attributes["p1"]
            same = all(attributes.get(key, first) == first for key in ("p2", "p3"))
            color = (group, first) if same else None
        part.colors.append(color)

    def _placed(self, attributes: dict[str, str]) -> tuple[ResourceId, FloatArray]:
        """An object and where it is placed, ``(4, 3)``."""
        number = self._id(self._text(attributes, "objectid"))
        path = attributes.get(ns.PRODUCTION + "path")
        if path is not None:
            if self._entry:
                self._refuse(
                    f"it places object {number.number} of {path[:80]}; the production extension "
                    "lets the root model alone place objects of other models: export it again"
                )
            entry = entry_name(path, "/", self.source, "a path of the root model")
            if entry != self._root:
                self.placed[entry] = None
                number = ResourceId(number.number, entry)
        numbers = attributes.get("transform", _IDENTITY).split()
        matrix = np.array([self._number(text) for text in numbers])
        if len(matrix) != 12 or abs(np.linalg.det(matrix[:9].reshape(3, 3))) == 0.0:
            self._refuse(
                f"the transform {' '.join(numbers)[:80]!r} places nothing; expected 12 numbers "
                "with a determinant other than 0"
            )
        return number, matrix.reshape(4, 3)

    def _id(self, number: str) -> ResourceId:
        """A resource of this model; one record for each, since triangles keep theirs."""
        return self._ids.setdefault(number, ResourceId(number, self._entry))

    def _object(self, name: str) -> ThreemfObject:
        if self._open is None:
            self._refuse(f"a {name.rpartition('}')[2]} stands outside any object; export it again")
        return self._open

    def _text(self, attributes: dict[str, str], key: str) -> str:
        if key not in attributes:
            self._refuse(f"an element lacks its {key}; export or copy the file again")
        return attributes[key]

    def _number(self, text: str) -> float:
        if not _NUMBER.fullmatch(text.strip()):
            self._refuse(f"found {text[:40]!r} where a number should be; export it again")
        return float(text)

    def _whole(self, text: str) -> int:
        if not _WHOLE.fullmatch(text.strip()):
            self._refuse(f"found {text[:40]!r} where an index should be; export it again")
        return int(text)

    def _refuse(self, why: str) -> NoReturn:
        where = f"{self.source}: {self._entry}" if self._entry else self.source
        raise PartError(f"{where}: {why}")
