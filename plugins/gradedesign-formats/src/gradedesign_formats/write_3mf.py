"""The printed lattice as 3MF: its surface, or round struts as beams.

3MF Core Specification 1.3 and Beam Lattice Extension 1.2.0 of the 3MF Consortium. Files are written
piece by piece and have no time stamps: equal lattices give equal files.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from gradedesign import LatticeError, PrintedLattice, SurfaceMesh, float32_vertices
from gradedesign_formats.beams import BeamLattice, beam_lattice
from gradedesign_formats.read_back_3mf import (
    MODEL,
    read_back,
    require_same_beams,
    require_same_surface,
)

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
BEAMS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
BALLS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07"
#: Namespace of metadata that the core specification has no name for.
METADATA = "urn:gradedesign:metadata"
#: Beams shorter than this are ignored by readers, mm; there are none.
SHORTEST = 1e-4

#: First date that a ZIP entry can have: equal lattices give equal files.
_DATE = (1980, 1, 1, 0, 0, 0)
#: Rows of a table that become text at a time. Bounds the memory of one step; the result does not
#: depend on it. Chosen, not measured.
_BATCH = 1 << 15
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    f'<Relationship Target="/{MODEL}" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)


def export_3mf(path: Path, lattice: PrintedLattice) -> None:
    """Write the surface of the printed lattice as 3MF, in mm, with metadata.

    Raises
    ------
    LatticeError
        If float32, in which readers hold it, cannot hold its detail.
    ResourceError
        If what is read back differs.
    """
    surface = SurfaceMesh(
        vertices=float32_vertices(lattice.surface.vertices), faces=lattice.surface.faces
    )
    _write(path, lattice, _mesh_object(1, lattice.name, surface), built=1)
    require_same_surface(path, read_back(path)[-1], lattice.surface)


def export_3mf_beams(path: Path, lattice: PrintedLattice) -> None:
    """Write a lattice of round struts as beams, cut by the part, with its solids as triangles.

    Radii are linear along a beam. Beams have a sphere at each end, as the distance to an axis has;
    nodes that are thicker have a ball of their own.

    Raises
    ------
    LatticeError
        If the cell is not made of round struts in equal cubes.
    ResourceError
        If what is read back differs.
    """
    if lattice.design is None or lattice.part is None:
        raise LatticeError('the lattice comes without struts; write "3mf" instead')
    beams = beam_lattice(lattice.design, lattice.part)
    clip = SurfaceMesh(vertices=float32_vertices(beams.clip.vertices), faces=beams.clip.faces)

    def content() -> Iterator[str]:
        yield from _mesh_object(1, "part that cuts the beams", clip)
        yield from _beam_object(2, lattice.name, beams)

    _write(path, lattice, content(), built=2, balls=len(beams.ball_nodes) > 0)
    clip_read, beams_read = read_back(path)
    require_same_surface(path, clip_read, beams.clip)
    require_same_beams(path, beams_read, beams)


def _write(
    path: Path,
    lattice: PrintedLattice,
    objects: Iterator[str],
    *,
    built: int,
    balls: bool | None = None,
) -> None:
    """The package; ``balls`` is None where there are no beams."""
    spaces, required = f'xmlns="{CORE}" xmlns:g="{METADATA}"', ""
    if balls is not None:
        spaces += f' xmlns:b="{BEAMS}"' + (f' xmlns:b2="{BALLS}"' if balls else "")
        required = f' requiredextensions="b{" b2" if balls else ""}"'
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in (("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS)):
            package.writestr(_entry(name), text)
        with package.open(_entry(MODEL), "w", force_zip64=True) as model:
            _put(
                model,
                '<?xml version="1.0" encoding="UTF-8"?>\n'
                f'<model unit="millimeter" xml:lang="en-US" {spaces}{required}>\n',
            )
            for name, value in _metadata(lattice):
                _put(model, f"<metadata name={quoteattr(name)}>{_text(value)}</metadata>\n")
            _put(model, "<resources>\n")
            for piece in objects:
                _put(model, piece)
            _put(model, f'</resources>\n<build><item objectid="{built}"/></build>\n</model>\n')


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, date_time=_DATE)
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def _put(model: IO[bytes], text: str) -> None:
    model.write(text.encode("utf-8"))


def _metadata(lattice: PrintedLattice) -> Iterator[tuple[str, str]]:
    """Name and value; in our namespace where the core specification has no name for it."""
    own = dict(lattice.metadata)
    yield "Title", own.pop("name")
    yield "Application", f"gradedesign {own.pop('gradedesign', '')}".strip()
    for name, value in own.items():
        yield f"g:{name}", value


def _text(value: str) -> str:
    """Content of an element: characters that XML 1.0 forbids become blanks."""
    return escape("".join(c if c.isprintable() else " " for c in value))


def _attribute(value: str) -> str:
    return quoteattr("".join(c if c.isprintable() else " " for c in value))


def _mesh_object(number: int, name: str, surface: SurfaceMesh) -> Iterator[str]:
    yield f'<object id="{number}" type="model" name={_attribute(name)}><mesh>\n'
    yield from _rows("vertices", '<vertex x="%.9g" y="%.9g" z="%.9g"/>', surface.vertices)
    yield from _rows("triangles", '<triangle v1="%d" v2="%d" v3="%d"/>', surface.faces)
    yield "</mesh></object>\n"


def _beam_object(number: int, name: str, beams: BeamLattice) -> Iterator[str]:
    """Beams, and the triangles of solids, in one mesh: readers unite them."""
    yield f'<object id="{number}" type="model" name={_attribute(name)}><mesh>\n'
    nodes, faces = np.asarray(beams.nodes), np.zeros((0, 3), dtype=np.int64)
    if beams.solid is not None:
        faces = beams.solid.faces + len(nodes)
        nodes = np.concatenate([nodes, float32_vertices(beams.solid.vertices)])
    yield from _rows("vertices", '<vertex x="%.9g" y="%.9g" z="%.9g"/>', nodes)
    yield from _rows("triangles", '<triangle v1="%d" v2="%d" v3="%d"/>', faces)
    first = float(beams.radii.flat[0])
    uniform = bool(np.ptp(beams.radii) <= 1e-9 * first)
    balls = ""
    if len(beams.ball_nodes):
        balls = f' b2:ballmode="mixed" b2:ballradius="{beams.ball_radii[0]:.9g}"'
    yield (
        f'<b:beamlattice radius="{first:.9g}" minlength="{SHORTEST:g}" cap="sphere" '
        f'clippingmode="inside" clippingmesh="1"{balls}>\n'
    )
    if uniform:
        yield from _rows("b:beams", '<b:beam v1="%d" v2="%d"/>', beams.beams)
    else:
        table = np.concatenate([beams.beams, beams.radii], axis=1)
        form = '<b:beam v1="%d" v2="%d" r1="%.9g" r2="%.9g"/>'
        yield from _rows("b:beams", form, table)
    if balls:
        table = np.stack([beams.ball_nodes, beams.ball_radii], axis=1)
        yield from _rows("b2:balls", '<b2:ball vindex="%d" r="%.9g"/>', table)
    yield "</b:beamlattice></mesh></object>\n"


def _rows(tag: str, form: str, table: NDArray[np.generic]) -> Iterator[str]:
    """One element a row of a table ``(n, c)``, in batches."""
    yield f"<{tag}>\n"
    for low in range(0, len(table), _BATCH):
        part = table[low : low + _BATCH]
        yield (form + "\n") * len(part) % tuple(part.ravel().tolist())
    yield f"</{tag}>\n"
