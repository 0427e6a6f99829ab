"""A 3MF file that was written here, read element by element and compared with the lattice."""

from __future__ import annotations

import zipfile
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from gradedesign import ResourceError, SurfaceMesh, require_read_back
from gradedesign.fields import FloatArray, IntArray
from gradedesign_formats.beams import BeamLattice

#: Where the model lies in the package.
MODEL = "3D/3dmodel.model"
#: Radii and places survive text and float32 within this share. Chosen, not measured.
_SAME = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectRead:
    """One object of a file as read back.

    Attributes
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
    beams : (k, 2) int array
    radii : (k, 2) array, mm
    balls : (b, 2) array
        Node and radius, mm.
    """

    vertices: FloatArray
    faces: IntArray
    beams: IntArray
    radii: FloatArray
    balls: FloatArray


def read_back(path: Path) -> list[ObjectRead]:
    """Objects of a file that was written here, in their order.

    Read element by element, so that numbers alone are held.
    """
    objects: list[ObjectRead] = []
    tables: dict[str, array[float]] = {}
    default = [0.0]
    keys = {
        "vertex": ("x", "y", "z"),
        "triangle": ("v1", "v2", "v3"),
        "b:beam": ("v1", "v2"),
        "b2:ball": ("vindex", "r"),
    }

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag in keys:
            tables[tag].extend([float(attributes[key]) for key in keys[tag]])
            if tag == "b:beam":
                tables["radius"].extend(
                    [float(attributes.get(key, default[0])) for key in ("r1", "r2")]
                )
        elif tag == "object":
            tables.update({key: array("d") for key in (*keys, "radius")})
        elif tag == "b:beamlattice":
            default[0] = float(attributes["radius"])

    def end(tag: str) -> None:
        if tag == "object":
            objects.append(_object(tables))

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    with zipfile.ZipFile(path) as package, package.open(MODEL) as model:
        parser.ParseFile(model)
    return objects


def _object(tables: Mapping[str, array[float]]) -> ObjectRead:
    def table(name: str, columns: int) -> FloatArray:
        return np.array(tables[name], dtype=np.float64).reshape(-1, columns)

    return ObjectRead(
        vertices=table("vertex", 3),
        faces=table("triangle", 3).astype(np.int64),
        beams=table("b:beam", 2).astype(np.int64),
        radii=table("radius", 2),
        balls=table("b2:ball", 2),
    )


def require_same_surface(path: Path, stored: ObjectRead, expected: SurfaceMesh) -> None:
    """Compare count, closedness and volume of triangles with those of the surface."""
    require_read_back(path, [stored.vertices[stored.faces]], expected)


def require_same_beams(path: Path, stored: ObjectRead, expected: BeamLattice) -> None:
    """Compare every strut, radius and ball with those of the lattice."""
    same = np.array_equal(stored.beams, expected.beams) and len(stored.balls) == len(
        expected.ball_nodes
    )
    if same:
        size = np.abs(expected.nodes).max()
        same = (
            np.allclose(stored.radii, expected.radii, rtol=_SAME, atol=0.0)
            and np.allclose(
                stored.vertices[: len(expected.nodes)], expected.nodes, atol=_SAME * size
            )
            and np.allclose(stored.balls[:, 1], expected.ball_radii, rtol=_SAME)
        )
    if same and expected.solid is not None:
        # The solids' triangles come after the nodes of the beams.
        shifted = ObjectRead(
            vertices=stored.vertices[len(expected.nodes) :],
            faces=stored.faces - len(expected.nodes),
            beams=stored.beams,
            radii=stored.radii,
            balls=stored.balls,
        )
        require_same_surface(path, shifted, expected.solid)
    if not same:
        raise ResourceError(
            f"{path} reads back with {len(stored.beams)} beams and {len(stored.balls)} balls, or "
            f"other places or radii; expected {len(expected.beams)} and "
            f"{len(expected.ball_nodes)}; check the disk and write it again"
        )
