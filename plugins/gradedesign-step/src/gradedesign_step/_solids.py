"""The solids of a STEP or IGES file, with names and colours of their faces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepLib import BRepLib
from OCP.collections import (
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher,
    Sequence_TCollection_AsciiString,
    Sequence_TDF_Label,
)
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_AttributeIterator, TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound
from OCP.XCAFDoc import (
    XCAFDoc_ColorGen,
    XCAFDoc_ColorSurf,
    XCAFDoc_ColorTool,
    XCAFDoc_DocumentTool,
    XCAFDoc_ShapeTool,
)

#: Loose faces are sewn where their edges lie within this distance, mm.
SEWING_MM = 0.01
#: Names that writers give to what has none.
_NAMELESS = {"", "NONE", "SOLID", "COMPOUND", "SHELL", "FACE", "ASSEMBLY"}
#: Units by the names that STEP and IGES files use; coordinates of other units are kept in mm.
_UNITS = {
    **dict.fromkeys(("mm", "millimetre", "millimeter"), "mm"),
    **dict.fromkeys(("cm", "centimetre", "centimeter"), "cm"),
    **dict.fromkeys(("m", "metre", "meter"), "m"),
    **dict.fromkeys(("in", "inch", "inches"), "inch"),
}


class FileRefused(Exception):  # noqa: N818 - an answer rather than an error of the program
    """A file that is no part; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CadFace:
    """One face of a solid, placed, with its own name and colour or those of its body."""

    shape: Any
    name: str | None
    color: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CadSolids:
    """All faces of all solids of a file, in the order in which CAD programs number them."""

    faces: tuple[CadFace, ...]
    shape: Any
    unit: str
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Body:
    """One solid or loose face, placed; ``faces`` are its faces with their own name and colour."""

    shape: Any
    name: str | None
    color: str | None
    faces: tuple[CadFace, ...]


def read_solids(path: str, form: str) -> CadSolids:
    """Read a file; coordinates are in mm, whatever its unit.

    Raises
    ------
    FileRefused
        If it is damaged, empty, or holds no closed solid.
    """
    document = TDocStd_Document(TCollection_ExtendedString("part"))
    unit, warnings = _transferred(path, form, document)
    roots = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    bodies: list[_Body] = []
    loose: list[CadFace] = []
    for k in range(1, roots.Length() + 1):
        for label, place in _simple_shapes(roots.Value(k), TopLoc_Location()):
            solids, free_faces = _bodies(label, place)
            bodies += solids
            loose += free_faces
    if loose:
        sewn, left_out = _sewn(loose)
        bodies += sewn
        if sewn:
            warnings.append(f"{len(loose) - left_out} loose faces sewn within {SEWING_MM} mm")
        if left_out and bodies:
            warnings.append(f"{left_out} faces belong to no solid and are left out")
    if not bodies:
        raise FileRefused(
            f"no solid in the file: {len(loose)} faces of it close none within {SEWING_MM} mm; "
            "join the surfaces to a solid in CAD and export that"
            if loose
            else "no solid and no face in the file; export the part as a solid"
        )
    faulty = sum(not BRepCheck_Analyzer(body.shape).IsValid() for body in bodies)
    if faulty:  # the triangles may close and be another body: a face inside out
        raise FileRefused(
            f"{faulty} of its {len(bodies)} solids have faults in their faces or edges, by "
            "OpenCASCADE's own check; heal the part in CAD, or export it as another format"
        )
    compound = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(compound)
    for body in bodies:
        builder.Add(compound, body.shape)
    several = len(bodies) > 1  # the name of the only body would be that of every face
    return CadSolids(
        faces=tuple(
            CadFace(
                shape=face.shape,
                name=face.name or (body.name if several else None),
                color=face.color or body.color,
            )
            for body in bodies
            for face in body.faces
        ),
        shape=compound,
        unit=unit,
        warnings=tuple(warnings),
    )


def _transferred(path: str, form: str, document: Any) -> tuple[str, list[str]]:
    """Fill a document from a file; its unit and remarks about it."""
    reader = STEPCAFControl_Reader() if form == "step" else IGESCAFControl_Reader()
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone:
        raise FileRefused(f"damaged, or not a {form.upper()} file; export or copy it again")
    names = _unit_names(reader, form)
    if not reader.Transfer(document):
        raise FileRefused("nothing in it can be read as a shape; export the part as a solid")
    units = {_UNITS.get(name.lower()) for name in names}
    if len(units) == 1 and None not in units:
        return str(units.pop()), []
    words = " and ".join(sorted(names)) or "none that is known"
    return "mm", [f"lengths of the file are in {words}; they are converted to mm"]


def _unit_names(reader: Any, form: str) -> set[str]:
    """Names of the length units in a file that was read."""
    if form == "iges":
        return {reader.IGESModel().GlobalSection().UnitName().ToCString()}
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.Reader().FileUnits(lengths, angles, solid_angles)
    return {lengths.Value(k).ToCString() for k in range(1, lengths.Length() + 1)}


def _simple_shapes(label: Any, place: Any) -> Iterator[tuple[Any, Any]]:
    """Labels of shapes that are no assemblies, and where they are placed."""
    if XCAFDoc_ShapeTool.IsReference_s(label):
        referred = TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(label, referred)
        yield from _simple_shapes(referred, place * XCAFDoc_ShapeTool.GetLocation_s(label))
    elif XCAFDoc_ShapeTool.IsAssembly_s(label):
        components = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        for k in range(1, components.Length() + 1):
            yield from _simple_shapes(components.Value(k), place)
    else:
        yield label, place


def _bodies(label: Any, place: Any) -> tuple[list[_Body], list[CadFace]]:
    """Solids of a shape, placed, and its faces that belong to none."""
    shape = XCAFDoc_ShapeTool.GetShape_s(label)
    numbers = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()  # knows shapes either way round
    whole = _name(label), _color(label)
    marks = {}
    parts = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetSubShapes_s(label, parts)
    for k in range(1, parts.Length() + 1):
        part = parts.Value(k)
        marks[numbers.Add(XCAFDoc_ShapeTool.GetShape_s(part))] = _name(part), _color(part)

    def faces_in(body: Any) -> Iterator[tuple[int, CadFace]]:
        for face in _parts(body, TopAbs_FACE):
            number = numbers.Add(face)
            name, color = marks.get(number, (None, None))
            yield number, CadFace(shape=face.Moved(place), name=name, color=color)

    bodies: list[_Body] = []
    taken: set[int] = set()
    for solid in _parts(shape, TopAbs_SOLID):
        name, color = marks.get(numbers.Add(solid), (None, None))
        faces = dict(faces_in(solid))
        taken.update(faces)
        bodies.append(
            _Body(
                shape=solid.Moved(place),
                name=name or whole[0],
                color=color or whole[1],
                faces=tuple(faces.values()),
            )
        )
    return bodies, [
        replace(face, color=face.color or whole[1])
        for number, face in faces_in(shape)
        if number not in taken
    ]


def _sewn(loose: list[CadFace]) -> tuple[list[_Body], int]:
    """Solids that loose faces close, and how many faces are left over."""
    sewing = BRepBuilderAPI_Sewing(SEWING_MM)
    for face in loose:
        sewing.Add(face.shape)
    sewing.Perform()
    numbers = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    made = {numbers.Add(sewing.ModifiedSubShape(face.shape)): face for face in loose}
    bodies: list[_Body] = []
    for shell in _parts(sewing.SewedShape(), TopAbs_SHELL):
        if not BRep_Tool.IsClosed_s(shell):
            continue
        solid = BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid()
        BRepLib.OrientClosedSolid_s(solid)
        unmarked = CadFace(shape=None, name=None, color=None)
        faces = tuple(
            replace(made.get(numbers.Add(face), unmarked), shape=face)
            for face in _parts(solid, TopAbs_FACE)
        )
        bodies.append(_Body(shape=solid, name=None, color=None, faces=faces))
    return bodies, len(loose) - sum(len(body.faces) for body in bodies)


def _parts(shape: Any, kind: Any) -> Iterator[Any]:
    """Different sub-shapes of a kind, in the order of the file."""
    explorer = TopExp_Explorer(shape, kind)
    seen = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    while explorer.More():
        current = explorer.Current()
        if not seen.Contains(current):
            seen.Add(current)
            yield current
        explorer.Next()


def _name(label: Any) -> str | None:
    """Name of a label that says something."""
    attributes = TDF_AttributeIterator(label)  # FindAttribute of this binding ends the process
    while attributes.More():
        if isinstance(attribute := attributes.Value(), TDataStd_Name):
            name = str(attribute.Get().ToExtString()).strip()
            return None if name.upper() in _NAMELESS or not name.isprintable() else name
        attributes.Next()
    return None


def _color(label: Any) -> str | None:
    """Colour of a label, ``#rrggbb``."""
    color = Quantity_Color()
    for kind in (XCAFDoc_ColorSurf, XCAFDoc_ColorGen):
        if XCAFDoc_ColorTool.GetColor_s(label, kind, color):
            shares = color.Values(Quantity_TOC_sRGB)
            return "#" + "".join(f"{round(255 * share):02x}" for share in shares)
    return None
