"""3MF files whose bodies have roles, by script, as slicers write them: volume and names are known.

Scenes are integer boxes of which no two faces of different bodies share a plane, so that counting
the cells between all planes gives the exact volume of what is left, whatever reads the file.
"""

from __future__ import annotations

import io
import random
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from xml.sax.saxutils import escape

import numpy as np
from scipy.ndimage import label as connected
from scipy.spatial.transform import Rotation

from gradedesign.geometry.part.box import box_surface

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
ALTERNATIVES = "http://schemas.microsoft.com/3dmanufacturing/production/alternatives/2021/04"
CURA = "http://software.ultimaker.com/xml/cura/3mf/2015/10"
ROOT = "/3D/3dmodel.model"


def relations(*targets: str) -> str:
    kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    rows = "".join(
        f'<Relationship Target="{escape(target)}" Id="r{k}" Type="{kind}"/>'
        for k, target in enumerate(targets)
    )
    uri = "http://schemas.openxmlformats.org/package/2006/relationships"
    return f'<Relationships xmlns="{uri}">{rows}</Relationships>'


PRUSA, BAMBU = "Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"
#: Edge of a unit of the scenes, mm: bases are 20 to 40 mm long.
UNIT = 0.125
#: Bodies of a scene have planes of their own: multiples of this, plus their number.
STEP = 8

#: Roles as the code names them, and as the files do.
PRUSA_TYPES = {
    "solid": "ModelPart",
    "negative volume": "NegativeVolume",
    "parameter modifier": "ParameterModifier",
    "support enforcer": "SupportEnforcer",
    "support blocker": "SupportBlocker",
}
BAMBU_TYPES = {
    "solid": "normal_part",
    "negative volume": "negative_part",
    "parameter modifier": "modifier_part",
    "support enforcer": "support_enforcer",
    "support blocker": "support_blocker",
}
CURA_TYPES = {
    "infill mesh": "infill_mesh",
    "cutting mesh": "cutting_mesh",
    "anti-overhang mesh": "anti_overhang_mesh",
    "support mesh": "support_mesh",
}
CORE_TYPES = {f"object of type {kind}": kind for kind in ("support", "solidsupport", "surface")}
CORE_TYPES |= {"object of type other": "other", "not printable": ""}
UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8}


@dataclass(frozen=True)
class Variant:
    """A file and the answer that it must get.

    ``volume`` in mm^3 and ``size`` in mm are None where it must be refused with ``words``;
    ``euler`` is the Euler characteristic of the surface, which a film in a hole or a hole in a film
    changes; ``left`` holds name and role of every body that is subtracted or left out, in the order
    of the file.
    """

    name: str
    data: bytes
    volume: float | None = None
    size: np.ndarray | None = None
    left: tuple[tuple[str, str], ...] = ()
    words: tuple[str, ...] = ()
    euler: int = 2


@dataclass(frozen=True)
class Box:
    """A body of a scene, in units of `UNIT`."""

    name: str
    role: str
    low: tuple[int, int, int]
    high: tuple[int, int, int]

    @property
    def vertices(self) -> np.ndarray:
        low, high = np.array(self.low, dtype=float), np.array(self.high, dtype=float)
        return (box_surface(tuple(high - low)).vertices + low) * UNIT


@dataclass
class Package:
    """Parts of a file as they are written; other models by their path, with their resources."""

    resources: list[str] = field(default_factory=list)
    items: list[str] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    unit: str = "millimeter"
    models: dict[str, list[str]] = field(default_factory=dict)
    related: tuple[str, ...] | None = None

    def data(self) -> bytes:
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("_rels/.rels", relations(ROOT))
            archive.writestr(ROOT[1:], self.model(self.resources, self.items))
            if self.models:
                related = self.models if self.related is None else self.related
                archive.writestr("3D/_rels/3dmodel.model.rels", relations(*related))
            for path, resources in self.models.items():
                # Items of other models than the root are to be passed over.
                archive.writestr(path[1:], self.model(resources, [item(77)]))
            for name, content in self.metadata.items():
                archive.writestr(name, f'<?xml version="1.0" encoding="UTF-8"?>\n{content}')
        return file.getvalue()

    def model(self, resources: Sequence[str], items: Sequence[str]) -> str:
        required = 'requiredextensions="p"' if self.models else ""
        return (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="{self.unit}" xmlns="{CORE}" '
            f'xmlns:cura="{CURA}" xmlns:slic3r="urn:slic3r" xmlns:p="{PRODUCTION}" '
            f'xmlns:pa="{ALTERNATIVES}" {required}>\n<resources>{"".join(resources)}</resources>\n'
            f"<build>{''.join(items)}</build></model>"
        )


FACES = box_surface((1.0, 1.0, 1.0)).faces


def mesh(*bodies: np.ndarray, inside: str = "", digits: int = 17) -> str:
    """Boxes by their vertices, as one mesh of twelve triangles each."""
    points = "".join(
        f'<vertex x="{x:.{digits}g}" y="{y:.{digits}g}" z="{z:.{digits}g}"/>'
        for body in bodies
        for x, y, z in body.tolist()
    )
    triangles = "".join(
        f'<triangle v1="{8 * k + a}" v2="{8 * k + b}" v3="{8 * k + c}"/>'
        for k in range(len(bodies))
        for a, b, c in FACES.tolist()
    )
    return f"<mesh><vertices>{points}</vertices><triangles>{triangles}</triangles>{inside}</mesh>"


def thing(number: int, inner: str, *, name: str = "", more: str = "", before: str = "") -> str:
    """An object."""
    called = f' name="{name}"' if name else ""
    return f'<object id="{number}"{called} {more}>{before}{inner}</object>'


def components(
    numbers: Sequence[int], places: Sequence[str] = (), paths: Sequence[str] = ()
) -> str:
    places, paths = places or [""] * len(numbers), paths or [""] * len(numbers)
    inner = "".join(
        f'<component objectid="{n}"{place and f" transform={chr(34)}{place}{chr(34)}"}'
        f"{path and f' p:path={chr(34)}{escape(path)}{chr(34)}'}/>"
        for n, place, path in zip(numbers, places, paths, strict=True)
    )
    return f"<components>{inner}</components>"


def item(number: int, place: str = "", more: str = "") -> str:
    moved = f' transform="{place}"' if place else ""
    return f'<item objectid="{number}"{moved} {more}/>'


def metadata_group(key: str, value: str = "True") -> str:
    return (
        '<metadatagroup><metadata name="cura:extruder_nr" preserve="1">0</metadata>'
        f'<metadata name="cura:{key}" type="xs:string" preserve="1">{value}</metadata>'
        "</metadatagroup>"
    )


def prusa_volume(first: int, last: int, name: str, kind: str | None, more: str = "") -> str:
    stated = "" if kind is None else f'<metadata type="volume" key="volume_type" value="{kind}"/>'
    return (
        f'<volume firstid="{first}" lastid="{last}">'
        f'<metadata type="volume" key="name" value="{name}"/>{stated}{more}</volume>'
    )


def prusa_config(*volumes: str, number: int = 1) -> dict[str, str]:
    head = '<metadata type="object" key="name" value="whole"/>'
    return {PRUSA: f'<config><object id="{number}">{head}{"".join(volumes)}</object></config>'}


def bambu_part(number: int, name: str, kind: str | None) -> str:
    stated = "" if kind is None else f' subtype="{kind}"'
    return f'<part id="{number}"{stated}><metadata key="name" value="{name}"/></part>'


def bambu_config(*parts: str, number: int = 9) -> dict[str, str]:
    head = '<metadata key="name" value="whole"/><metadata key="extruder" value="1"/>'
    plate = '<plate><metadata key="plater_id" value="1"/></plate>'
    return {BAMBU: f'<config><object id="{number}">{head}{"".join(parts)}</object>{plate}</config>'}


@dataclass(frozen=True)
class Placement:
    """An affine map of points as rows, and its text in a file."""

    matrix: np.ndarray
    shift: np.ndarray

    @property
    def text(self) -> str:
        return " ".join(f"{x!r}" for x in [*self.matrix.ravel().tolist(), *self.shift.tolist()])

    @property
    def scale(self) -> float:
        return abs(float(np.linalg.det(self.matrix)))

    def moved(self, points: np.ndarray) -> np.ndarray:
        return points @ self.matrix + self.shift

    def undone(self, points: np.ndarray) -> np.ndarray:
        return (points - self.shift) @ np.linalg.inv(self.matrix)


HERE = Placement(np.eye(3), np.zeros(3))


def placement(rng: random.Random) -> Placement:
    """As it stands, shifted, turned about an axis, turned freely and stretched; half mirrored."""
    matrix = np.eye(3)
    kind = rng.choice(["here", "shifted", "quarter", "free", "stretched"])
    if kind == "quarter":
        matrix = np.roll(matrix, rng.randrange(3), axis=1)
    elif kind in ("free", "stretched"):
        matrix = free_turn(rng)
    if kind == "stretched":
        matrix = np.diag([rng.uniform(0.5, 2.0) for _ in range(3)]) @ matrix
    if rng.random() < 0.5:
        matrix = np.diag(rng.choice([(-1.0, 1, 1), (1.0, -1, 1), (-1.0, -1, -1)])) @ matrix
    shift = np.zeros(3) if kind == "here" else np.array([rng.uniform(-90, 90) for _ in range(3)])
    return Placement(matrix, shift)


def cells_left(scene: Sequence[Box]) -> tuple[list[np.ndarray], np.ndarray]:
    """Planes along each axis, and which cells between them are solid in the end: the oracle."""
    planes = [np.unique([b.low[k] for b in scene] + [b.high[k] for b in scene]) for k in range(3)]
    solid = np.zeros([len(p) - 1 for p in planes], dtype=bool)
    for body in scene:
        if body.role in ("solid", "negative volume"):
            span = [
                slice(int(np.searchsorted(p, a)), int(np.searchsorted(p, b)))
                for p, a, b in zip(planes, body.low, body.high, strict=True)
            ]
            solid[tuple(span)] = body.role == "solid"
    return planes, solid


def volume(scene: Sequence[Box]) -> float:
    """Volume of what is left of a scene, mm^3."""
    planes, solid = cells_left(scene)
    x, y, z = (np.diff(p) * UNIT for p in planes)
    return float((x[:, None, None] * y[:, None] * z)[solid].sum())


def euler(solid: np.ndarray) -> int:
    """Euler characteristic of solid cells with faces, edges and corners: half of the surface's."""
    padded = np.pad(solid, 1)
    total = 0
    for across in np.ndindex(2, 2, 2):  # axes along which a face, edge or corner is shared
        found = np.zeros_like(padded)
        for shift in np.ndindex(*(1 + a for a in across)):
            found |= np.roll(padded, shift, axis=(0, 1, 2))
        total += (-1) ** (3 - sum(across)) * int(found.sum())
    return total


def solid_size(planes: Sequence[np.ndarray], solid: np.ndarray, place: Placement) -> np.ndarray:
    """Box of the placed solid, mm."""
    corners = []
    for shift in np.ndindex(2, 2, 2):
        index = np.argwhere(solid) + shift
        corners.append(np.stack([planes[k][index[:, k]] for k in range(3)], axis=1) * UNIT)
    return np.ptp(place.moved(np.concatenate(corners)), axis=0)


def scene(rng: random.Random, roles: Sequence[str], *, flush: bool) -> list[Box]:
    """A base and bodies of these roles, each of which reaches into it or, if it adds nothing, not.

    Every negative volume reaches out of all that is solid, and one solid is left.
    """
    while True:
        high = tuple(STEP * rng.randrange(*span) for span in ((30, 40), (22, 30), (20, 26)))
        found = [Box("base", "solid", (0, 0, 0), high)]
        for k, role in enumerate(roles, start=1):
            low, top = [], []
            through = rng.randrange(3)
            for axis, length in enumerate(high):
                a, b = sorted(rng.sample(range(1, length // STEP - 1), 2))
                low.append(STEP * a + k)
                top.append(STEP * b + k + STEP)
                if axis == through and role in ("solid", "negative volume"):
                    # Out of the base at one end or both, flush with it or beyond.
                    beyond = 0 if flush else STEP * rng.randrange(1, 5) + k
                    if rng.random() < 0.5 and role == "negative volume":
                        low[axis] = -beyond
                    top[axis] = length + (beyond or (0 if role != "solid" else STEP + k))
            if role not in ("solid", "negative volume") and rng.random() < 0.3:
                low[0], top[0] = low[0] + 3 * high[0], top[0] + 3 * high[0]
            found.append(Box(f"{role} {k}", role, tuple(low), tuple(top)))
        if plain(found):
            return found


def plain(found: Sequence[Box]) -> bool:
    """Whether one solid without voids is left that touches itself nowhere along an edge."""
    _, solid = cells_left(found)
    padded = np.pad(solid, 1)
    if not solid.any() or connected(solid)[1] != 1 or connected(~padded)[1] != 1:
        return False
    for k, body in enumerate(found):  # each negative volume takes something
        if body.role == "negative volume" and not volume(found[: k + 1]) < volume(found[:k]):
            return False
    # Two solid cells across an edge whose other two are empty.
    for a, b in ((0, 1), (1, 2), (0, 2)):
        quad = [np.roll(padded, (i, j), axis=(a, b)) for i in (0, 1) for j in (0, 1)]
        if ((quad[0] == quad[3]) & (quad[1] == quad[2]) & (quad[0] != quad[1])).any():
            return False
    return True


def answer(
    name: str, found: Sequence[Box], package: Package, place: Placement, order: Sequence[Box] = ()
) -> Variant:
    """A file of a scene that must be read, and what it must give."""
    scale = UNITS[package.unit]
    return Variant(
        name=name,
        data=package.data(),
        volume=volume(found) * place.scale * scale**3,
        size=solid_size(*cells_left(found), place) * scale,
        left=tuple((b.name, b.role) for b in order or found if b.role != "solid"),
        euler=2 * euler(cells_left(found)[1]),
    )


def by_prusa(rng: random.Random, found: Sequence[Box], name: str, *, inline: bool) -> Variant:
    """One mesh with ranges of triangles, beside the model or, as Slic3r does, within it."""
    place = placement(rng)
    package = Package(unit=rng.choice(list(UNITS)))
    ranges = [(12 * k, 12 * k + 11, body) for k, body in enumerate(found)]
    inside = ""
    if inline:
        inside = "".join(
            f'<slic3r:volume ts="{a}" te="{b}" modifier="{int(body.role != "solid")}"/>'
            for a, b, body in ranges
        )
        inside = f"<slic3r:volumes>{inside}</slic3r:volumes>"
    else:
        # Elements of text and drawings have a prefix that the file does not declare.
        more = '<slic3rpe:text text="A" depth="2"/><mesh edges_fixed="0"/>'
        old = '<metadata type="volume" key="modifier" value="1"/>'
        package.metadata = prusa_config(
            *(
                prusa_volume(
                    a,
                    b,
                    body.name,
                    PRUSA_TYPES[body.role],
                    more + (old if body.role == "parameter modifier" else ""),
                )
                for a, b, body in ranges
            )
        )
    package.resources = [thing(1, mesh(*(body.vertices for body in found), inside=inside))]
    package.items = [item(1, place.text, 'printable="1"')]
    if inline:  # which has no names
        called = [f"the volume of triangles {a} to {b} of object 1" for a, b, _ in ranges]
        found = [replace(body, name=own) for body, own in zip(found, called, strict=True)]
    return answer(name, found, package, place)


def by_bambu(
    rng: random.Random, found: Sequence[Box], name: str, models: Sequence[str] = ()
) -> Variant:
    """One component for each body, of a mesh that is placed, turned or mirrored by itself.

    The meshes stand in the root model or in others, one path for each body.
    """
    outer, package, places = placement(rng), Package(unit=rng.choice(list(UNITS))), []
    for number, body in enumerate(found, start=1):
        inner = placement(rng)
        vertices, faces = inner.undone(body.vertices), ""
        if np.linalg.det(inner.matrix) < 0.0:  # outward where it is stored
            vertices, faces = vertices[MIRRORED], ""
        kind = 'type="other"' if body.role != "solid" and rng.random() < 0.7 else ""
        path = models[number - 1] if models else ROOT
        stored = package.resources if path == ROOT else package.models.setdefault(path, [])
        stored.append(thing(number, mesh(vertices) + faces, more=kind))
        places.append(inner.text)
    numbers = range(1, len(found) + 1)
    # Numbers are of one model: the assembly may have that of a body in another.
    whole = rng.choice([1, 9]) if models and ROOT not in models else 9
    package.resources.append(thing(whole, components(numbers, places, models)))
    package.items = [item(whole, outer.text, 'printable="1"')]
    parts = (bambu_part(n, b.name, BAMBU_TYPES[b.role]) for n, b in enumerate(found, start=1))
    package.metadata = bambu_config(*parts, number=whole)
    return answer(name, found, package, outer)


#: Vertices of `box_surface` such that its faces enclose the mirror image of a box outward.
MIRRORED = np.array(
    [
        int(np.flatnonzero((box_surface((1.0, 1.0, 1.0)).vertices == v).all(axis=1))[0])
        for v in box_surface((1.0, 1.0, 1.0)).vertices * [-1, 1, 1] + [1, 0, 0]
    ]
)


def by_items(rng: random.Random, found: Sequence[Box], name: str) -> Variant:
    """An item or, in an assembly within another, a component for each body, as Cura and others."""
    place, package = placement(rng), Package(unit=rng.choice(list(UNITS)))
    grouped = rng.random() < 0.5 and all(b.role != "not printable" for b in found)
    for number, body in enumerate(found, start=1):
        cura = CURA_TYPES.get(body.role)
        kind = CORE_TYPES.get(body.role)
        package.resources.append(
            thing(
                number,
                mesh(body.vertices),
                name=body.name,
                more=f'type="{kind}"' if kind else "",
                before=metadata_group(cura) if cura else metadata_group("infill_mesh", "False"),
            )
        )
        parked = 'printable="0"' if body.role == "not printable" else ""
        package.items.append(item(number, place.text, parked))
    if grouped:
        numbers = range(1, len(found) + 1)
        package.resources.append(thing(8, components(numbers)))
        package.resources.append(thing(9, components([8], [place.text])))
        package.items = [item(9)]
    return answer(name, found, package, place)


def scenes(seed: int = 20261126) -> Iterator[Variant]:
    """Files that must be read: all writers, roles, orders, units and placements."""
    rng = random.Random(seed)
    others = [role for role in PRUSA_TYPES if role not in ("solid", "negative volume")]
    solid, negative = "solid", "negative volume"
    orders = [
        [negative], [negative, negative], [negative, solid], [solid, negative],
        [negative, solid, negative], [solid, negative, negative],
    ]  # fmt: skip
    for number in range(24):
        order = [*orders[number % len(orders)]]
        for role in rng.sample(others, rng.randrange(3)):
            order.insert(rng.randrange(len(order) + 1), role)
        found = scene(rng, order, flush=number % 3 == 0)
        yield by_prusa(rng, found, f"PrusaSlicer {number}: {', '.join(order)}", inline=False)
        yield by_bambu(rng, found, f"Bambu Studio {number}: {', '.join(order)}")
    for number in range(4):
        found = scene(rng, ["parameter modifier"] * (1 + number % 2) + [solid], flush=False)
        yield by_prusa(rng, found, f"Slic3r {number}", inline=True)
    for number in range(24):
        order = rng.sample([*CURA_TYPES, *CORE_TYPES], 1 + number % 3)
        if number % 4 == 3:
            order.insert(rng.randrange(len(order) + 1), solid)
        found = scene(rng, order, flush=False)
        yield by_items(rng, found, f"items {number}: {', '.join(order)}")


def production_scenes(seed: int = 20261129) -> Iterator[Variant]:
    """Files whose meshes stand in models of their own, as Bambu Studio and OrcaSlicer save them."""
    rng = random.Random(seed)
    for number in range(24):
        order = rng.choices(list(BAMBU_TYPES), k=rng.randrange(4))
        found = scene(rng, order, flush=number % 3 == 0)
        # One model of the whole object, one for each body, or some bodies in the root model.
        paths = ["/3D/Objects/a & b_1.model"] * len(found)
        if number % 3 == 1:
            paths = [f"/3D/Objects/object_{k}.model" for k in range(len(found))]
        elif number % 3 == 2:
            paths = [rng.choice([ROOT, "/3D/object.model"]) for _ in found]
        yield by_bambu(rng, found, f"production {number}: {', '.join(order) or 'solid'}", paths)


def block(name: str = "block", role: str = "solid", x: int = 0) -> Box:
    """10 x 5 x 2.5 mm: 125 mm^3."""
    return Box(name, role, (x, 0, 0), (x + 80, 40, 20))


def two(more: str = "", *, first: str = "", before: str = "") -> list[str]:
    """Objects 1 and 2: a block, and one of other type or metadata."""
    return [
        thing(1, mesh(block().vertices), name="block", more=first),
        thing(2, mesh(block(x=8).vertices), name="second", more=more, before=before),
    ]


def refused_by_prusa() -> Iterator[Variant]:
    """Ranges of triangles that contradict the mesh or each other, and types that are unknown."""
    whole = [thing(1, mesh(block().vertices, block(x=8).vertices), name="whole")]
    old = '<metadata key="modifier" value="{}"/>'
    a, hole = prusa_volume(0, 11, "a", "ModelPart"), "NegativeVolume"
    tables = {
        "overlap": (a, prusa_volume(11, 23, "hole", hole),
                    "triangles 11 to 23 of object 1", "triangles 0 to 11 of object 1"),
        "outside": (a, prusa_volume(12, 24, "hole", hole),
                    "triangles 12 to 24 of object 1", "24 triangles are there"),
        "backwards": (a, prusa_volume(23, 12, "hole", hole), "triangles 23 to 12 of object 1"),
        "gap": (a, prusa_volume(14, 23, "hole", hole), "'whole'", "triangles 12 to 13"),
        "rest": (prusa_volume(0, 11, "hole", hole), "'whole'", "triangles 12 to 23"),
        "negative index": (a, prusa_volume(-1, 11, "hole", hole), "'-1'", "firstid"),
        "no index": (a.replace('lastid="11"', ""), "lacks its lastid"),
        "unknown type": (a, prusa_volume(12, 23, "seam", "SeamPosition"),
                         "'SeamPosition'", "triangles 12 to 23 of object 1", "NegativeVolume"),
        "two types": (a, prusa_volume(12, 23, "b", hole, prusa_volume_type("SupportBlocker")),
                      "two roles, negative volume and support blocker"),
        "modifier and type": (a, prusa_volume(12, 23, "b", hole, old.format(1)),
                              "two roles, negative volume and parameter modifier"),
        "modifier of value 2": (a, prusa_volume(12, 23, "b", None, old.format(2)), "'2'"),
        "all left out": (prusa_volume(0, 23, "only", "SupportEnforcer"),
                         "no solid is left", "'only' (support enforcer)"),
        "first of all": (prusa_volume(0, 11, "hole", hole),
                         prusa_volume(12, 23, "b", "ParameterModifier"), "no solid is left"),
    }  # fmt: skip
    for name, texts in tables.items():
        volumes = [text for text in texts if text.startswith("<")]
        words = tuple(text for text in texts if not text.startswith("<"))
        package = Package(whole, [item(1)], prusa_config(*volumes))
        yield Variant(f"PrusaSlicer, {name}", package.data(), words=words)
    package = Package(whole, [item(1)], prusa_config(a, number=7))
    words = (PRUSA, "object 7, which the model does not have")
    yield Variant("PrusaSlicer, no object", package.data(), words=words)
    package = Package([*two(), thing(9, components([1, 2]))], [item(9)])
    package.metadata = prusa_config(a, prusa_volume(12, 23, "hole", hole), number=9)
    words = ("object 9", "which has components instead of triangles")
    yield Variant("PrusaSlicer, ranges of an assembly", package.data(), words=words)
    package = Package(whole, [item(1)], {PRUSA: "<config><object id='1'>"})
    yield Variant("PrusaSlicer, cut", package.data(), words=(PRUSA, "is damaged in line"))
    bomb = '<!DOCTYPE a [<!ENTITY b "c">]><config/>'
    package = Package(whole, [item(1)], {PRUSA: bomb})
    yield Variant("PrusaSlicer, entities", package.data(), words=(PRUSA, "document type"))
    package = Package(whole, [item(1)], {BAMBU: f"<config><!--{' ' * 2_000_000}--></config>"})
    deep = f"<config>{'<a>' * 200}{'</a>' * 200}</config>"
    yield Variant("PrusaSlicer, deep", Package(whole, [item(1)], {PRUSA: deep}).data(),
                  words=(PRUSA, "nests elements more than 100 deep"))  # fmt: skip
    yield Variant("Bambu Studio, bomb", package.data(), words=(BAMBU, "unpacks to more than"))


def prusa_volume_type(kind: str) -> str:
    return f'<metadata type="volume" key="volume_type" value="{kind}"/>'


def refused_by_bambu() -> Iterator[Variant]:
    """Parts that no object has, with two roles or with unknown ones."""
    good, hole = bambu_part(1, "block", "normal_part"), bambu_part(2, "hole", "negative_part")
    other = bambu_part(2, "hole", "normal_part")
    assembly = thing(9, components([1, 2]))
    cura = metadata_group("support_mesh")
    cases = {
        "no such component": (two(), bambu_config(good, hole, bambu_part(3, "x", "normal_part")),
                              "part 3 of object 9", "no such component; found 1, 2"),
        "no object": (two(), bambu_config(good, hole, number=12),
                      "object 12, which the model does not have"),
        "unknown subtype": (two(), bambu_config(good, bambu_part(2, "x", "seam_part")),
                            "part 2 of object 9", "'seam_part'", "negative_part"),
        "no id": (two(), bambu_config(good, hole.replace(' id="2"', "")), "lacks its id"),
        "two roles of a part": (two(), bambu_config(good, hole, other),
                                "part 2 of object 9", "two roles, negative volume and solid"),
        "type support": (two('type="support"'), bambu_config(good, hole),
                         "object 2 'second'", "negative volume", "object of type support"),
        "type other, normal": (two('type="other"'), bambu_config(good, other),
                               "object 2 'second'", "solid", "object of type other"),
        "metadata of Cura": (two(before=cura), bambu_config(good, hole),
                             "object 2 'second'", "negative volume", "support mesh"),
        "all cut away": ([two()[0], thing(2, mesh(1.5 * block().vertices - 1.0))],
                         bambu_config(good, hole), "no solid is left", "'hole' (negative volume)"),
    }  # fmt: skip
    for name, (resources, metadata, *words) in cases.items():
        package = Package([*resources, assembly], [item(9)], metadata)
        yield Variant(f"Bambu Studio, {name}", package.data(), words=tuple(words))
    package = Package([*two(), assembly], [item(9)], bambu_config(good, hole))
    bar = Box("bar", "negative volume", (30, -8, -8), (50, 48, 28))
    package.resources[1] = thing(2, mesh(bar.vertices), name="bar")
    yield Variant("Bambu Studio, cut in two", package.data(), words=("2 separate solids",))
    package.resources[1] = thing(2, mesh(bar.vertices).replace(FIRST_TRIANGLE, ""), name="bar")
    yield Variant("Bambu Studio, open negative volume", package.data(),
                  words=("the negative volume 'hole'", "the surface is open"))  # fmt: skip


FIRST_TRIANGLE = '<triangle v1="{}" v2="{}" v3="{}"/>'.format(*FACES[0].tolist())


def refused_otherwise() -> Iterator[Variant]:
    """Metadata of Cura, attributes and types that are unknown or contradict each other."""
    both = [item(1), item(2)]
    group = metadata_group("infill_mesh")
    second = '<metadata name="cura:infill_mesh">False</metadata></metadatagroup>'
    cases = {
        "unknown mesh": (two(before=metadata_group("seam_mesh")), both,
                         "object 2 'second'", "cura:seam_mesh", "infill_mesh"),
        "unknown value": (two(before=metadata_group("infill_mesh", "maybe")), both,
                          "cura:infill_mesh of object 2 'second'", "'maybe'"),
        "two meshes": (two(before=group + metadata_group("support_mesh")), both,
                       "object 2 'second' has 2 roles", "infill mesh", "support mesh"),
        "True and False": (two(before=group.replace("</metadatagroup>", second)), both,
                           "cura:infill_mesh twice"),
        "unknown type": (two('type="fixture"'), both, "object 2 'second'", "'fixture'"),
        "unknown printable": (two(), [item(1), item(2, more='printable="x"')],
                              "printable of item 2 (object 2)", "'x'"),
        "nothing printable": (two(), [item(n, more='printable="0"') for n in (1, 2)],
                              "no solid is left", "'block' (not printable)"),
        "type and mesh": (two('type="support"', before=group), both,
                          "object 2 'second' has 2 roles", "infill mesh", "type support"),
    }  # fmt: skip
    for name, (resources, items, *words) in cases.items():
        yield Variant(f"other, {name}", Package(resources, items).data(), words=tuple(words))


def single_files() -> Iterator[Variant]:
    """Files that must be read, each for one rule."""
    inner = Box("dense", "parameter modifier", (8, 8, 4), (40, 32, 16))
    bodies = [block(), inner]
    whole = [thing(1, mesh(*(b.vertices for b in bodies)))]
    package = Package(whole, [item(1)], prusa_config(
        prusa_volume(0, 11, "block", None),
        prusa_volume(12, 23, "dense", None, '<metadata key="modifier" value="1"/>'),
    ))  # fmt: skip
    yield answer("a modifier of old versions", bodies, package, HERE)
    void = [block(), Box("void", "negative volume", (8, 8, 4), (40, 32, 16))]
    package = Package(whole, [item(1)], prusa_config(
        prusa_volume(0, 11, "block", "ModelPart"), prusa_volume(12, 23, "void", "NegativeVolume"),
    ))  # fmt: skip
    yield answer("a void", void, package, HERE)
    package = Package(two('type="other"'), [item(1)])
    yield answer("an object that is not built", [block()], package, HERE)
    parts = bambu_config(*(bambu_part(n, "x", "normal_part") for n in (1, 2)))
    joined = [block(), Box("second", "solid", (8, 8, 4), (120, 48, 28))]
    things = [thing(n, mesh(b.vertices)) for n, b in enumerate(joined, start=1)]
    flavours = prusa_config(
        prusa_volume(0, 11, "a", "ModelPart"), prusa_volume(12, 23, "b", "ModelPart"), number=9
    )
    package = Package([*things, thing(9, components([1, 2]))], [item(9)], {**parts, **flavours})
    yield answer("metadata of two slicers that agree", joined, package, HERE)
    # Two solids that touch are cut together and stay two.
    wide = Box("wide", "negative volume", (70, 10, -4), (90, 20, 40))
    touching = [block(), block("end", x=80), wide]
    package = Package([thing(1, mesh(*(b.vertices for b in touching)))], [item(1)], prusa_config(
        *(prusa_volume(12 * k, 12 * k + 11, b.name, PRUSA_TYPES[b.role])
          for k, b in enumerate(touching)),
    ))  # fmt: skip
    words = ("2 separate solids", "touch along")
    yield Variant("two solids that touch, cut", package.data(), words=words)
    # A negative volume cuts in its own assembly, not in its neighbour.
    bar = Box("bar", "negative volume", (-8, 8, 4), (96, 32, 40))
    slot = Box("slot", "negative volume", (30, -8, 8), (50, 96, 40))
    found = [block(), slot, Box("second", "solid", (16, 8, 4), (120, 48, 28))]
    package = Package(
        [
            *(thing(n, mesh(b.vertices)) for n, b in enumerate(found, start=1)),
            thing(8, components([1, 2])),
            thing(9, components([8, 3])),
        ],
        [item(9)],
        bambu_config(
            bambu_part(1, "a", "normal_part"), bambu_part(2, "slot", "negative_part"), number=8
        ),
    )
    yield answer("an assembly in an assembly", found, package, HERE)
    # A whole assembly as a negative volume, cut itself before: a rib stays in the slot.
    rib = Box("rib", "negative volume", (40, -16, -8), (44, 104, 60))
    wide = [block(), bar, Box("kept", "solid", (40, 8, 4), (44, 32, 20))]
    package = Package(
        [
            *(thing(n, mesh(b.vertices)) for n, b in enumerate([block(), bar, rib], start=1)),
            thing(8, components([2, 3])),
            thing(9, components([1, 8])),
        ],
        [item(9)],
    )
    inner = bambu_part(2, "bar", "normal_part"), bambu_part(3, "rib", "negative_part")
    outer = bambu_part(1, "block", "normal_part"), bambu_part(8, "bar", "negative_part")
    tables = [bambu_config(*inner, number=8)[BAMBU], bambu_config(*outer)[BAMBU]]
    package.metadata = {BAMBU: "".join(tables).replace("</config><config>", "")}
    order = [rib, bar]
    yield answer("a negative assembly", wide, package, HERE, order)


def production_files() -> Iterator[Variant]:
    """Files of several models that must be read, each for one rule, and those that are refused."""
    path, other = "/3D/Objects/object_1.model", "/3D/Objects/object_2.model"
    second = Box("second", "solid", (8, 8, 4), (120, 48, 28))
    one, two_ = (thing(n, mesh(b.vertices), name=b.name) for n, b in ((1, block()), (2, second)))
    # The same number in two models, and an item of an assembly of another model.
    package = Package([one], [item(1), item(1, more=f'p:path="{path}"')], models={path: [
        thing(2, mesh(second.vertices)), thing(1, components([2]))]})  # fmt: skip
    yield answer("production, an item of another model", [block(), second], package, HERE)
    package = Package([one], [item(1)], models={path: [two_]})
    yield answer("production, a model that is not placed", [block()], package, HERE)
    package = Package([one, thing(9, components([1], paths=[ROOT]))], [item(9)])
    yield answer("production, the path of the root model", [block()], package, HERE)
    spaced, quoted = "/3D/Objects/a b.model", "Objects/a%20b.model"
    package = Package([one, thing(9, components([1, 2], paths=[ROOT, spaced]))], [item(9)],
                      models={spaced: [two_]}, related=(quoted,))  # fmt: skip
    yield answer("production, a relation that is quoted", [block(), second], package, HERE)
    whole = thing(9, components([1, 2], paths=[path, other]))
    parts = bambu_part(1, "block", "normal_part"), bambu_part(2, "hole", "negative_part")
    both = {path: [one], other: [two_]}
    hidden = {path: [one.replace("<object", '<object pa:modelresolution="lowres"')], other: [two_]}
    inner = [thing(1, components([2], paths=[other]))]
    twice = {path: [one], other: [thing(1, mesh(second.vertices))]}
    same = thing(9, components([1, 1], paths=[path, other]))
    out = thing(9, components([1], paths=["/../../object_1.model"]))
    cases: dict[str, tuple[Package, tuple[str, ...]]] = {
        "no target": (Package([whole], models={path: [one]}, related=(path, other)),
                      ("the part 3D/Objects/object_2.model is missing",)),
        "no relation": (Package([whole], models=both, related=(path,)),
                        ("places objects of 3D/Objects/object_2.model", "no relation")),
        "no object": (Package([whole], models={path: [one], other: [one]}),
                      ("object 2 of 3D/Objects/object_2.model is missing",)),
        "out of the package": (Package([out], models=both), ("leads out of the package",)),
        "a relation out of it": (Package([whole], models=both, related=("../../a", path, other)),
                                 ("3D/_rels/3dmodel.model.rels leads out of the package",)),
        "a path elsewhere": (Package([whole], models={path: inner, other: [two_]}),
                             ("3D/Objects/object_1.model", "the root model alone")),
        "in itself": (Package([whole], models={path: [thing(1, components([1]))], other: [two_]}),
                      ("object 1 of 3D/Objects/object_1.model", "contain themselves")),
        "a stand-in": (Package([whole], models=hidden), ("object 1 of", "'lowres'", "fullres")),
        "one number, two models": (
            Package([same], metadata=bambu_config(*parts[:1]), models=twice),
            ("part 1 of object 9", "2 such components", "1 of 3D/Objects/object_2.model")),
        "no such part": (Package([whole], metadata=bambu_config(bambu_part(
            9, "x", "normal_part")), models=both), ("1 of 3D/Objects/object_1.model, 2 of",)),
        "all cut away": (Package([whole], metadata=bambu_config(parts[1], bambu_part(
            1, "block", "modifier_part")), models=both), ("no solid is left", "'hole'")),
    }  # fmt: skip
    for name, (package, words) in cases.items():
        package.items = [item(9)]
        yield Variant(f"production, {name}", package.data(), words=words)
    # A model in another unit than the root model.
    package = Package([whole], [item(9)], models=both)
    text = package.data()
    yield Variant("production, two units", altered(text, other[1:], "millimeter", "inch"),
                  words=("object_2.model", "its unit is 'inch'", "'millimeter'"))  # fmt: skip
    yield Variant("production, cut", altered(text, path[1:], "</build></model>", ""),
                  words=("3D/Objects/object_1.model is damaged in line",))  # fmt: skip


def altered(data: bytes, entry: str, old: str, new: str) -> bytes:
    """A package of which one entry has other text."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as before, zipfile.ZipFile(file, "w") as archive:
        for name in before.namelist():
            text = before.read(name).decode()
            archive.writestr(name, text.replace(old, new) if name == entry else text)
    return file.getvalue()


def flush_files() -> Iterator[Variant]:
    """Negative volumes that end flush, or side by side, but for the rounding of a turned file."""
    rng = random.Random(20261127)
    flush = {
        "through": [Box("slot", "negative volume", (16, 8, 0), (24, 32, 20))],
        "pocket": [Box("slot", "negative volume", (16, 8, 8), (24, 32, 20))],
        "corner": [Box("slot", "negative volume", (0, 0, 8), (24, 32, 20))],
        "across": [Box("slot", "negative volume", (16, -8, 8), (24, 48, 20))],
        "beside": [
            Box("slot", "negative volume", (16, 8, 0), (24, 32, 20)),
            Box("slot", "negative volume", (24, 8, 0), (48, 24, 20)),
        ],
        "twice": [Box("slot", "negative volume", (16, 8, 0), (24, 32, 20))] * 2,
    }
    for digits in (7, 9):
        for name, cutters in flush.items():
            found, package, places = [block(), *cutters], Package(), []
            turned = [Placement(free_turn(rng), np.full(3, 5.0)) for _ in found]
            for number, (body, inner) in enumerate(zip(found, turned, strict=True), start=1):
                stored = mesh(inner.undone(body.vertices), digits=digits)
                package.resources.append(thing(number, stored))
                places.append(inner.text)
            numbers = range(1, len(found) + 1)
            package.resources.append(thing(9, components(numbers, places)))
            package.items = [item(9)]
            package.metadata = bambu_config(
                *(
                    bambu_part(n, body.name, BAMBU_TYPES[body.role])
                    for n, body in zip(numbers, found, strict=True)
                )
            )
            yield answer(f"flush, {name}, {digits} digits", found, package, HERE)


def free_turn(rng: random.Random) -> np.ndarray:
    angles = [rng.uniform(-180.0, 180.0) for _ in range(3)]
    return Rotation.from_euler("xyz", angles, degrees=True).as_matrix()


def role_variants() -> list[Variant]:
    """All files, about 170."""
    return [
        *scenes(), *production_scenes(), *production_files(), *flush_files(), *single_files(),
        *refused_by_prusa(), *refused_by_bambu(), *refused_otherwise(),
    ]  # fmt: skip
