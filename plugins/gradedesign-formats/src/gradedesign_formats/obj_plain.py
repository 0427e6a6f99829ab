"""An OBJ file reduced to vertices, triangles and numbered groups, checked before it is decoded."""

from __future__ import annotations

from typing import NoReturn

from gradedesign import PartError

#: Statements that are read; all others, such as normals and texture coordinates, are passed over.
_NAMING = {"o": 0, "g": 1, "usemtl": 2}


def plain_obj(text: str, source: str) -> tuple[str, dict[str, str], int]:
    """Rewrite an OBJ file with one numbered group for each object, group and material.

    Returns
    -------
    text : str
        Of statements ``v``, ``f`` and ``g``.
    names : dict of str to str
        Names of the groups by their number: the group's, else the object's, else the material's.

    Raises
    ------
    PartError
        For a face that is no triangle, or a corner that is not there.
    ValueError
        For a coordinate that is no number.
    """
    rows: list[str] = []
    current: tuple[str, str, str] = ("", "", "")
    numbers: dict[tuple[str, str, str], int] = {}
    written = -1
    triangles = 0
    points: list[list[str]] = []
    colored = True
    highest = 0
    text = text.replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        key, _, rest = line.strip().partition(" ")
        if key == "v":
            values = [repr(float(word)) for word in rest.partition("#")[0].split()]
            if len(values) not in (3, 4, 6, 7):
                _refuse(source, number, f"a vertex of {len(values)} numbers, expected 3")
            colored &= len(values) >= 6
            points.append([*values[:3], *values[-3:]])
        elif key in _NAMING:
            at = _NAMING[key]
            changed = [*current]
            changed[at] = rest.strip()
            current = (changed[0], changed[1], changed[2])
        elif key == "f":
            corners = [word.partition("/")[0] for word in rest.partition("#")[0].split()]
            if len(corners) != 3:
                _refuse(source, number, f"a face of {len(corners)} corners; export it triangulated")
            if not all(c.isdecimal() and c.isascii() and int(c[:12]) for c in corners):
                _refuse(
                    source, number, f"a face of corners {' '.join(corners)}, expected 1 or more"
                )
            highest = max(highest, *(int(c[:12]) for c in corners))
            group = numbers.setdefault(current, len(numbers))
            if group != written:
                rows.append(f"g {group}")
                written = group
            rows.append(f"f {' '.join(corners)}")
            triangles += 1
    if highest > len(points):
        raise PartError(
            f"{source}: a face uses vertex {highest}, the file holds {len(points)}; it is cut or "
            "damaged, export or copy it again"
        )
    names = {
        str(group): name
        for (body, part, material), group in numbers.items()
        if (name := part if part not in ("", "default", "off") else body or material)
    }
    vertices = [f"v {' '.join(point[: 6 if colored else 3])}" for point in points]
    return "\n".join([*vertices, *rows, ""]), names, triangles


def _refuse(source: str, line: int, why: str) -> NoReturn:
    raise PartError(f"{source}:{line}: {why}")
