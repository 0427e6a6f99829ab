"""Triangles of a solid by the OpenCASCADE that made it, of version 7.9 (CadQuery) or 8 (build123d).

Only what both have is used; ``OCP`` is the binding that is installed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape

from gradedesign import PartError
from gradedesign_cad.solid_file import Solid

#: Chord tolerance where none is stated, as a share of the diagonal.
_DEFAULT_SHARE = 1e-4
#: Facets of one face turn against each other by no more than this, radians: 12 degrees.
_TURN = 0.21
#: Volumes of triangles and exact faces differ by no more than this share, and the chords.
_SAME_VOLUME = 0.002
#: Attributes by which libraries hand out shapes: ``vals()`` of a CadQuery workplane,
#: ``toCompound()`` of its assembly, ``part`` of a build123d builder.
_SEVERAL, _WHOLE, _BUILT = "vals", "toCompound", "part"

#: Version 7 marks static methods by their name.
_as_face = getattr(TopoDS, "Face_s", None) or TopoDS.Face


def triangulated(solid: Any, named: Mapping[str, Any], chord_tolerance: float | None) -> Solid:
    """Triangulate a copy of a solid.

    Raises PartError as `gradedesign_cad.write_part` does.
    """
    bodies = [body for shape in _shapes(solid) for body in _parts(shape, TopAbs_SOLID)]
    if not bodies:
        raise PartError(
            f"no solid in {type(solid).__name__}; expected a solid, or what holds solids, of "
            f"CadQuery or build123d"
        )
    faulty = sum(not BRepCheck_Analyzer(body).IsValid() for body in bodies)
    if faulty:  # the triangles may close and be another body: a face inside out
        raise PartError(
            f"{faulty} of {len(bodies)} solids have faults in their faces or edges, by "
            f"OpenCASCADE's own check; build them another way"
        )
    faces = [face for body in bodies for face in _parts(body, TopAbs_FACE)]
    names = _names(faces, named)
    diagonal = _diagonal(bodies)
    tolerance = _DEFAULT_SHARE * diagonal if chord_tolerance is None else chord_tolerance
    corners, exact = [], 0.0
    for body in bodies:
        copy = BRepBuilderAPI_Copy(body, True, False).Shape()
        BRepMesh_IncrementalMesh(copy, tolerance, False, _TURN, False)
        corners += [_face_corners(face) for face in _parts(copy, TopAbs_FACE)]
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(copy, properties)
        # Of a mirrored solid it is negative; one inside out is turned as any part is.
        exact += abs(float(properties.Mass()))
    empty = [number for number, own in enumerate(corners, 1) if not len(own)]
    if empty or len(corners) != len(faces):
        raise PartError(
            f"faces {', '.join(map(str, empty[:8]))} of {len(faces)} cannot be triangulated; state "
            f"another chord_tolerance than {tolerance:.3g} mm, or build the solid another way"
        )
    triangles = np.concatenate(corners)
    _require_volume(triangles, exact, tolerance)
    return Solid(
        corners=triangles,
        label=np.repeat(np.arange(1, len(faces) + 1), [len(own) for own in corners]),
        names=names,
        surfaces={number: _surface(face) for number, face in enumerate(faces, 1)},
        chord_tolerance=tolerance,
    )


def _shapes(thing: Any) -> Iterator[Any]:
    """Shapes of the kernel in what a library hands out."""
    if isinstance(thing, TopoDS_Shape):
        yield thing
    elif isinstance(getattr(thing, "wrapped", None), TopoDS_Shape):
        yield thing.wrapped
    elif hasattr(thing, _SEVERAL):
        yield from _shapes(thing.vals())
    elif hasattr(thing, _WHOLE):
        yield from _shapes(thing.toCompound())
    elif hasattr(thing, _BUILT):
        yield from _shapes(thing.part)
    elif isinstance(thing, Iterable) and not isinstance(thing, str | bytes):
        for one in thing:
            yield from _shapes(one)


def _parts(shape: Any, kind: Any) -> Iterator[Any]:
    """Different sub-shapes of a kind, in their order."""
    explorer = TopExp_Explorer(shape, kind)
    seen: dict[int, list[Any]] = {}
    while explorer.More():
        current = explorer.Current()
        alike = seen.setdefault(hash(current), [])
        if not any(current.IsSame(other) for other in alike):
            alike.append(current)
            yield current
        explorer.Next()


def _names(faces: list[Any], named: Mapping[str, Any]) -> dict[int, str]:
    """Name of each face that has one, by its number."""
    result: dict[int, str] = {}
    for name, things in named.items():
        if not isinstance(name, str) or not name.strip():
            raise PartError(f"faces: found the name {name!r}; expected a text")
        own = [face for shape in _shapes(things) for face in _parts(shape, TopAbs_FACE)]
        if not own:
            raise PartError(f'faces["{name}"]: no face; its selector finds none')
        for face in own:
            number = next((k for k, one in enumerate(faces, 1) if one.IsSame(face)), None)
            if number is None:
                raise PartError(
                    f'faces["{name}"]: one of its {len(own)} faces is none of the solid; select it '
                    f"on the solid as it is written, after the last step that changes it"
                )
            if result.setdefault(number, name) != name:
                raise PartError(
                    f'faces["{name}"]: face {number} is "{result[number]}" already; a face has one '
                    f"name, and a region of a case may take several: any = [...]"
                )
    return result


def _diagonal(bodies: list[Any]) -> float:
    box = Bnd_Box()
    for body in bodies:
        BRepBndLib.AddOptimal_s(body, box, False, False)
    return float(np.sqrt(box.SquareExtent()))


def _face_corners(face: Any) -> NDArray[np.float64]:
    """Triangles of a face, outward: (m, 3, 3), mm."""
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(_as_face(face), location)
    if mesh is None or mesh.NbTriangles() == 0:
        return np.zeros((0, 3, 3))
    points = (mesh.Node(k) for k in range(1, mesh.NbNodes() + 1))
    nodes = np.array([(p.X(), p.Y(), p.Z()) for p in points])
    triangles = (mesh.Triangle(k) for k in range(1, mesh.NbTriangles() + 1))
    index = np.array([[t.Value(k) for k in (1, 2, 3)] for t in triangles], dtype=np.int64) - 1
    move = location.Transformation()
    if not location.IsIdentity():
        matrix = np.array([[move.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)])
        nodes = nodes @ matrix[:, :3].T + matrix[:, 3]
    if (face.Orientation() == TopAbs_REVERSED) != move.IsNegative():
        index = index[:, ::-1]
    return nodes[index]


def _require_volume(corners: NDArray[np.float64], exact: float, tolerance: float) -> None:
    """Refuse triangles that enclose another volume than the exact faces, mm^3."""
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    volume = abs(float((a * np.cross(b, c)).sum())) / 6.0
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    if not abs(volume - exact) <= _SAME_VOLUME * exact + tolerance * area:
        raise PartError(
            f"its triangles enclose {volume:.6g} mm^3, its exact faces {exact:.6g} mm^3; state a "
            f"smaller chord_tolerance than {tolerance:.3g} mm"
        )


def _surface(face: Any) -> dict[str, Any]:
    """Kind, and of a cylinder the axis, a point on it and the diameter in mm."""
    adaptor = BRepAdaptor_Surface(_as_face(face))
    kind = adaptor.GetType()
    if kind == GeomAbs_Plane:
        return {"kind": "plane"}
    if kind != GeomAbs_Cylinder:
        return {"kind": "other"}
    cylinder = adaptor.Cylinder()
    axis = cylinder.Axis()
    point, direction = axis.Location(), axis.Direction()
    return {
        "kind": "cylinder",
        "axis": [direction.X(), direction.Y(), direction.Z()],
        "point": [point.X(), point.Y(), point.Z()],
        "diameter": 2.0 * cylinder.Radius(),
    }
