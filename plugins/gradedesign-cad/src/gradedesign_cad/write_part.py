"""A solid of a CAD library in Python as the file of a part, with names of its faces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gradedesign import PartError
from gradedesign_cad.solid_file import SUFFIX, write_solid


def write_part(
    solid: Any,
    path: str | Path,
    *,
    faces: Mapping[str, Any] | None = None,
    chord_tolerance: float | None = None,
) -> Path:
    """Write a solid as the file of a part, which ``[part] file`` names.

    The kernel that made the solid triangulates a copy of it. Planes and cylinders are kept as they
    are, so that regions of a case find them without a fit.

    Parameters
    ----------
    solid : object
        Of CadQuery a ``Workplane``, ``Shape`` or ``Assembly``, of build123d a ``Part``, ``Solid``,
        ``Compound`` or ``BuildPart``, or a ``TopoDS_Shape``; lengths in mm.
    path : str or Path
        Ends with ``.solid``; its folder is there. A file is replaced.
    faces : mapping of str to object, optional
        Name and what it names: a face or several of this solid, as its library selects them. A
        region states ``name = "..."``; a name for several faces takes all of them.
    chord_tolerance : float, mm, optional
        Largest distance of the triangles from curved faces; by default a ten-thousandth of the
        diagonal.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    PartError
        If it is no solid, its faces cannot be triangulated, or a name is for a face that is none of
        the solid, or has one already.

    Examples
    --------
    >>> import cadquery  # doctest: +SKIP
    >>> plate = cadquery.Workplane().box(40, 30, 10).faces(">Z").workplane().hole(8)
    ... # doctest: +SKIP
    >>> write_part(plate, "plate.solid", faces={"bore": plate.faces("%CYLINDER")})
    ... # doctest: +SKIP
    """
    file = Path(path)
    if file.suffix.lower() != SUFFIX:
        raise PartError(f"{file.name}: a solid is written as {SUFFIX}; name it {file.stem}{SUFFIX}")
    if chord_tolerance is not None and not 0.0 < chord_tolerance < float("inf"):
        raise PartError(f"chord_tolerance: found {chord_tolerance} mm; expected more than 0")
    try:
        from gradedesign_cad._kernel import triangulated
    except ImportError as error:
        raise PartError(
            f"no OpenCASCADE can be imported ({error}); the library that made the solid brings it: "
            f"pip install cadquery, or build123d"
        ) from error
    write_solid(file, triangulated(solid, faces or {}, chord_tolerance))
    return file
