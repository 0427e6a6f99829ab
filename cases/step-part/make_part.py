"""Make lever.step: a lever with a hub and a pin hole, whose faces have names and colours.

Run ``python make_part.py`` in this folder; needs the binding of OpenCASCADE that the plugin
gradedesign-step installs. Lengths in mm: the lever lies along x, both holes run along z.
"""

from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

REACH, WIDTH, HEIGHT = 48.0, 16.0, 12.0
HUB_DIAMETER, PIN_DIAMETER = 10.0, 6.0
#: Name and colour of the walls of the holes, by where their axes lie along x.
MARKED = {0.0: ("hub", (0.0, 0.6, 0.0)), REACH: ("pin", (1.0, 0.0, 0.0))}
BODY = (0.7, 0.7, 0.75)


def cylinder(x: float, diameter: float) -> TopoDS_Shape:
    """A cylinder along z through the height of the lever."""
    axes = gp_Ax2(gp_Pnt(x, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    return BRepPrimAPI_MakeCylinder(axes, diameter / 2, HEIGHT).Shape()


def lever() -> TopoDS_Shape:
    """A bar with round ends about both holes."""
    body = BRepPrimAPI_MakeBox(gp_Pnt(0.0, -WIDTH / 2, 0.0), REACH, WIDTH, HEIGHT).Shape()
    for x in MARKED:
        body = BRepAlgoAPI_Fuse(body, cylinder(x, WIDTH)).Shape()
    one = ShapeUpgrade_UnifySameDomain(body, True, True, False)
    one.Build()
    body = one.Shape()
    for x, diameter in ((0.0, HUB_DIAMETER), (REACH, PIN_DIAMETER)):
        body = BRepAlgoAPI_Cut(body, cylinder(x, diameter)).Shape()
    return body


def properties(shape: TopoDS_Shape, *, volume: bool) -> GProp_GProps:
    """Volume or area of a shape, with its centroid."""
    found = GProp_GProps()
    if volume:
        BRepGProp.VolumeProperties_s(shape, found)
    else:
        BRepGProp.SurfaceProperties_s(shape, found)
    return found


def hole_at(face: TopoDS_Shape) -> float | None:
    """Which hole this face is the wall of; the centroid of a wall lies on its axis."""
    found = properties(face, volume=False)
    centre = found.CentreOfMass()
    for x, diameter in ((0.0, HUB_DIAMETER), (REACH, PIN_DIAMETER)):
        area = 3.141592653589793 * diameter * HEIGHT
        if abs(centre.X() - x) < 1e-6 and abs(found.Mass() - area) < 1e-6 * area:
            return x
    return None


def document(shape: TopoDS_Shape) -> TDocStd_Document:
    """The lever with its name, and the walls of both holes with theirs."""
    result = TDocStd_Document(TCollection_ExtendedString("lever"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(result.Main())
    colors = XCAFDoc_DocumentTool.ColorTool_s(result.Main())
    label = shapes.AddShape(shape, False)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString("lever"))
    colors.SetColor(label, Quantity_Color(*BODY, Quantity_TOC_sRGB), XCAFDoc_ColorGen)
    faces = TopExp_Explorer(shape, TopAbs_FACE)
    while faces.More():
        x = hole_at(faces.Current())
        if x is not None:
            name, color = MARKED[x]
            face = shapes.AddSubShape(label, faces.Current())
            TDataStd_Name.Set_s(face, TCollection_ExtendedString(name))
            colors.SetColor(face, Quantity_Color(*color, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        faces.Next()
    return result


if __name__ == "__main__":
    part = lever()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(document(part), STEPControl_AsIs)
    writer.Write(str(Path(__file__).with_name("lever.step")))
    print(f"{properties(part, volume=True).Mass():.1f} mm^3")
