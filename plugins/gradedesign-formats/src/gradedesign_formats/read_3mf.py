"""Parts from 3MF files: core specification, production extension, colours, roles of slicers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gradedesign import UNIT_MM, FileFaces, PartError, RawTriangles, raw_triangles
from gradedesign_formats._threemf_bodies import BodyReader
from gradedesign_formats._threemf_metadata import SlicerMetadata
from gradedesign_formats._threemf_model import ThreemfModel
from gradedesign_formats._threemf_package import open_package
from gradedesign_formats._threemf_roles import ThreemfRoles

#: The core's unit for a unit of 3MF, and how many of them it has.
_UNITS = {
    "micron": ("mm", 1e-3),
    "millimeter": ("mm", 1.0),
    "centimeter": ("cm", 1.0),
    "inch": ("inch", 1.0),
    "foot": ("inch", 12.0),
    "meter": ("m", 1.0),
}


def read_3mf(path: Path) -> RawTriangles:
    """Read the solids of all build items of a 3MF file, where they are placed.

    Negative volumes are taken away from what stands before them in their object; modifiers,
    supports and what is not printable are left out. A face of the part is what has one colour in
    one placed mesh; its name is that of the volume, component or object.

    Raises
    ------
    PartError
        If the file is missing, damaged, too large once unpacked, or needs an extension that is not
        read, such as the slice extension; if its roles are unknown or contradict each other,
        or leave no solid.
    """
    model, metadata = ThreemfModel(path.name), SlicerMetadata(path.name)
    with open_package(path) as package:
        root = package.root()
        package.parse(root, model.handler(root))
        package.require_related(root, list(model.placed))
        for entry in model.placed:
            package.parse(entry, model.handler(entry))
        for entry in package.entries:
            handler = metadata.handler(entry)
            if handler is not None:
                package.parse(entry, handler, namespaces=False)
    if model.unit not in _UNITS:
        raise PartError(
            f"{path.name}: its unit is {model.unit!r}; expected one of {', '.join(_UNITS)}"
        )
    unit, factor = _UNITS[model.unit]
    roles = ThreemfRoles(model, metadata)
    reader = BodyReader(model=model, roles=roles, scale=factor * UNIT_MM[unit])
    bodies = reader.bodies()
    label = np.concatenate([np.zeros(0, dtype=np.int64), *(body.label for body in bodies)])
    names, colors = reader.names, reader.colors
    faces = FileFaces(label=label, names=names, colors=colors)
    return raw_triangles(
        np.concatenate([np.zeros((0, 3, 3)), *(body.corners * factor for body in bodies)]),
        source=path.name,
        unit=unit,
        faces=faces if names or colors or reader.face_count > 1 else None,
        warnings=list(dict.fromkeys(reader.notes)),
        file_bodies=reader.found,
    )
