"""Objects, colours and build items of a 3MF model, gathered as its elements arrive."""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import PartError

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
_MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06}"
#: Extensions that messages call by their name.
_EXTENSIONS = {
    _PRODUCTION: "production",
    "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02}": "beam lattice",
    "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07}": "slice",
    "http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04}": "secure content",
    "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01}": "volumetric",
}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_WHOLE = re.compile(r"\d{1,9}")
_COLOR = re.compile(r"#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?")
_IDENTITY = "1 0 0 0 1 0 0 0 1 0 0 0"
_GROUPS = (_CORE + "basematerials", _MATERIAL + "colorgroup")
#: Objects of these types are solids; others are supports or surfaces.
_SOLID = "model"


@dataclass(slots=True, kw_only=True)
class ThreemfObject:
    """A mesh or an assembly of others; ``colors`` holds group and index of every triangle."""

    kind: str
    name: str | None
    color: tuple[str, str] | None
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    colors: list[tuple[str, str] | None] = field(default_factory=list)
    components: list[tuple[str, FloatArray]] = field(default_factory=list)

    @property
    def is_solid(self) -> bool:
        """Whether it is part of the solid."""
        return self.kind == _SOLID


class ThreemfModel:
    """A model as far as it has been parsed.

    Attributes
    ----------
    source : str
        Name of the file, for messages.
    unit : str
        As the file says.
    objects : dict of str to ThreemfObject
    items : list of (str, (4, 3) array)
        Objects that are built, and where: a point as a row times the first three rows, plus the
        last.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.unit = ""
        self.objects: dict[str, ThreemfObject] = {}
        self.items: list[tuple[str, FloatArray]] = []
        self._colors: dict[str, list[str | None]] = {}
        self._group: list[str | None] = []
        self._open: ThreemfObject | None = None
        self._namespaces: dict[str, str] = {}

    def prefix(self, prefix: str, namespace: str) -> None:
        """Remember a prefix: required extensions are named by it."""
        self._namespaces[prefix] = namespace + "}"

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Take one element; elements of extensions that are not required are passed over."""
        if name == _CORE + "vertex":
            numbers = [self._number(self._text(attributes, axis)) for axis in "xyz"]
            self._object(name).vertices.extend(numbers)
        elif name == _CORE + "triangle":
            self._triangle(self._object(name), attributes)
        elif name == _CORE + "model":
            self._begin(attributes)
        elif not self.unit:
            self._refuse("its model is not of 3MF's core specification; export it again as 3MF")
        elif name == _CORE + "object":
            self._begin_object(attributes)
        elif name == _CORE + "component":
            self._object(name).components.append(self._placed(attributes))
        elif name == _CORE + "item":
            self.items.append(self._placed(attributes))
        elif name in _GROUPS:
            self._group = self._colors.setdefault(self._text(attributes, "id"), [])
        elif name in (_CORE + "base", _MATERIAL + "color"):
            text = attributes.get("displaycolor", attributes.get("color", ""))
            self._group.append(text[:7].lower() if _COLOR.fullmatch(text) else None)

    def end(self, name: str) -> None:
        """Close an object."""
        if name == _CORE + "object":
            self._open = None

    def color(self, reference: tuple[str, str] | None) -> str | None:
        """Colour ``#rrggbb`` of a group and an index; None where the group holds no colours."""
        if reference is None or reference[0] not in self._colors:
            return None
        group, index = self._colors[reference[0]], self._whole(reference[1])
        if index >= len(group):
            self._refuse(f"colour {index} of group {reference[0]} is missing; export it again")
        return group[index]

    def _begin(self, attributes: dict[str, str]) -> None:
        self.unit = attributes.get("unit", "millimeter")
        for prefix in attributes.get("requiredextensions", "").split():
            namespace = self._namespaces.get(prefix, "")
            if namespace not in (_CORE, _MATERIAL):
                self._refuse_extension(_EXTENSIONS.get(namespace, prefix))

    def _begin_object(self, attributes: dict[str, str]) -> None:
        number = self._text(attributes, "id")
        if number in self.objects or self._open is not None:
            self._refuse(f"object {number} is there twice, or inside another; export it again")
        color = None
        if "pid" in attributes:
            color = attributes["pid"], attributes.get("pindex", "0")
        self._open = self.objects[number] = ThreemfObject(
            kind=attributes.get("type", _SOLID),
            name=attributes.get("name", "").strip() or None,
            color=color,
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
            group = attributes.get("pid", "" if part.color is None else part.color[0])
            first = attributes["p1"]
            same = all(attributes.get(key, first) == first for key in ("p2", "p3"))
            color = (group, first) if same else None
        part.colors.append(color)

    def _placed(self, attributes: dict[str, str]) -> tuple[str, FloatArray]:
        """An object and where it is placed, ``(4, 3)``."""
        if _PRODUCTION + "path" in attributes:
            self._refuse_extension("production")
        numbers = attributes.get("transform", _IDENTITY).split()
        matrix = np.array([self._number(text) for text in numbers])
        if len(matrix) != 12 or abs(np.linalg.det(matrix[:9].reshape(3, 3))) == 0.0:
            self._refuse(
                f"the transform {' '.join(numbers)[:80]!r} places nothing; expected 12 numbers "
                "with a determinant other than 0"
            )
        return self._text(attributes, "objectid"), matrix.reshape(4, 3)

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

    def _refuse_extension(self, name: str) -> NoReturn:
        self._refuse(
            f"needs the {name} extension of 3MF, which is not read; export the part as plain 3MF "
            "(core specification), STL or STEP"
        )

    def _refuse(self, why: str) -> NoReturn:
        raise PartError(f"{self.source}: {why}")
