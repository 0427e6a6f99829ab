"""The pictures of a run: what is asked, the density, the lattice, its stress and shape."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets, centroids
from gradedesign.output import _draw_opengl, _draw_plain
from gradedesign.output._opengl import opengl_works
from gradedesign.output.region_mark import (
    COLOURS,
    RegionMark,
    Role,
    anchor_point,
    load_arrows,
    unit_normals,
)
from gradedesign.output.scene import (
    ColourBar,
    Label,
    Layer,
    Lines,
    Scene,
    hatch,
    sharp_edges,
    thinned,
)
from gradedesign.workspace.atomic import write_bytes
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)

_ABOVE = "#ff00c8"
#: Lengths in a picture, in diagonals of the part.
_ARROW, _HATCH, _SHOWN_SHIFT = 0.16, 0.012, 0.08
#: Surfaces of more triangles are lattices: their edges at rest would cover everything.
_OUTLINED = 50_000


def picture_loads(
    path: Path, surface: SurfaceMesh, marks: Sequence[RegionMark], *, title: str = "Loading"
) -> tuple[str, ...]:
    """Draw the part with supports (blue, hatched), loads (red arrows) and kept regions (olive).

    Returns
    -------
    tuple of str
        Warnings; a picture never fails a run.
    """
    diagonal = _diagonal(surface.vertices)
    layers = []
    lines, arrows, labels = [], [], []
    told: dict[tuple[str, Role], tuple[FloatArray, tuple[str, ...]]] = {}
    for mark in (m for m in marks if len(m.corners)):
        colour = COLOURS[mark.role]
        lifted = mark.corners + 1e-3 * diagonal * unit_normals(mark.corners)[:, None, :]
        faces = np.arange(3 * len(lifted)).reshape(-1, 3)
        layers.append(Layer(vertices=lifted.reshape(-1, 3), faces=faces, colour=colour))
        if mark.role == "support":
            lines.append(Lines(segments=hatch(lifted, _HATCH * diagonal), colour="white"))
        anchor = anchor_point(mark.corners)
        if mark.role == "load":
            arrows += load_arrows(mark, _ARROW * diagonal)
            anchor = arrows[-1].tail
        key = (mark.name, mark.role)
        point, texts = told.get(key, (anchor, ()))
        told[key] = (point, (*texts, mark.text) if mark.text else texts)
    # One label per region: those of several load cases would cover each other.
    for (name, role), (point, texts) in told.items():
        text = f"{name}: {', '.join(texts)}" if texts else name
        labels.append(Label(point=point, text=text, colour=COLOURS[role]))
    # Last and translucent: regions on the far side show through.
    part = Layer(vertices=surface.vertices, faces=surface.faces, colour="#d5d9de", opacity=0.35)
    lines.append(Lines(segments=sharp_edges(part), colour="#555555", width=1.5))
    scene = Scene(
        title=title,
        caption="blue: supports   red: loads   olive: kept solid",
        layers=(*layers, part),
        lines=tuple(lines),
        arrows=tuple(arrows),
        labels=tuple(labels),
    )
    return _draw(path, scene)


def picture_density(
    path: Path, mesh: TetMesh, rho: FloatArray, *, title: str = "Relative density"
) -> tuple[str, ...]:
    """Draw element densities ``(m,)`` with the quarter towards the viewer cut away."""
    rho = np.asarray(rho, dtype=np.float64)
    middle = 0.5 * (mesh.points.min(axis=1) + mesh.points.max(axis=1))
    x, y, z = centroids(mesh) - middle[:, None]
    kept = np.flatnonzero(~((x > 0) & (y < 0) & (z > 0)))
    shown = TetMesh(points=mesh.points, tets=mesh.tets[:, kept])
    facets, owners = boundary_facets(shown)
    layer = Layer(vertices=mesh.points.T, faces=facets, values=rho[kept][owners], per_face=True)
    scene = Scene(
        title=title,
        caption=f"relative density {rho.min():.3g} to {rho.max():.3g}, the corner towards the "
        f"viewer cut away",
        layers=(layer,),
        bar=ColourBar(title="density [-]", low=float(rho.min()), high=float(rho.max())),
    )
    return _draw(path, scene)


def picture_lattice(path: Path, surface: SurfaceMesh, *, title: str = "Lattice") -> tuple[str, ...]:
    """Draw the surface that is printed."""
    size = np.ptp(surface.vertices, axis=0)
    caption = f"{len(surface.faces)} triangles, {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm"
    layer = Layer(vertices=surface.vertices, faces=surface.faces, colour="#7f9fbf")
    return _draw(path, Scene(title=title, caption=caption, layers=(layer,)))


def picture_stress(
    path: Path,
    surface: SurfaceMesh,
    von_mises: FloatArray,
    *,
    limit: float | None = None,
    title: str = "Stress",
) -> tuple[str, ...]:
    """Draw von Mises stress ``(n,)`` MPa at the vertices; above the limit in magenta.

    The bar ends at the limit. Where even the maximum is below half of it, or without a limit,
    it ends at the maximum.
    """
    values = np.asarray(von_mises, dtype=np.float64)
    top = float(values.max())
    high = limit if limit is not None and top >= 0.5 * limit else top
    caption = f"maximum {top:.4g} MPa"
    if limit is not None:
        over = float(np.mean(values > limit))
        caption += f", limit {limit:.4g} MPa, above it {100 * over:.2g} % of the vertices (magenta)"
    layer = Layer(vertices=surface.vertices, faces=surface.faces, values=values)
    bar = ColourBar(
        title="von Mises [MPa]",
        low=0.0,
        high=high,
        colours="turbo",
        above=_ABOVE if limit is not None and top > limit else None,
    )
    return _draw(path, Scene(title=title, caption=caption, layers=(layer,), bar=bar))


def picture_deformed(
    path: Path,
    surface: SurfaceMesh,
    displacement: FloatArray,
    *,
    factor: float | None = None,
    title: str = "Deformed shape",
) -> tuple[str, ...]:
    """Draw the surface moved by ``factor`` times its displacement ``(3, n)`` mm.

    Without a factor the largest displacement is drawn at about a twelfth of the diagonal, with
    a factor of 1, 2 or 5 times a power of ten. The caption names the factor.
    """
    displacement = np.asarray(displacement, dtype=np.float64)
    size = np.linalg.norm(displacement, axis=0)
    if factor is None:
        factor = round_factor(_SHOWN_SHIFT * _diagonal(surface.vertices), float(size.max()))
    moved = Layer(
        vertices=surface.vertices + factor * displacement.T, faces=surface.faces, values=size
    )
    lines: tuple[Lines, ...] = ()
    note = ""
    if len(surface.faces) <= _OUTLINED:
        rest = Layer(vertices=surface.vertices, faces=surface.faces)
        lines = (Lines(segments=sharp_edges(rest), colour="#888888", width=1.5),)
        note = "; grey edges: at rest"
    scene = Scene(
        title=title,
        caption=f"deformation drawn x {factor:g}, largest displacement {size.max():.4g} mm{note}",
        layers=(moved,),
        lines=lines,
        bar=ColourBar(title="displacement [mm]", low=0.0, high=float(size.max()), colours="plasma"),
    )
    return _draw(path, scene)


def boundary_surface(mesh: TetMesh) -> tuple[SurfaceMesh, IntArray]:
    """Boundary of a tetrahedral mesh, and the mesh point of each of its vertices ``(n,)``."""
    facets, _ = boundary_facets(mesh)
    used, packed = np.unique(facets, return_inverse=True)
    vertices = mesh.points[:, used].T
    return SurfaceMesh(vertices=vertices, faces=packed.reshape(facets.shape)), used


def round_factor(wanted: float, largest: float) -> float:
    """Largest of 1, 2, 5 times a power of ten by which ``largest`` stays within ``wanted``."""
    if not largest > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted / largest))
    share = wanted / largest / power
    return float(power * max(n for n in (1, 2, 5) if n <= max(share, 1.0)))


def _draw(path: Path, scene: Scene) -> tuple[str, ...]:
    """Draw with OpenGL, or plainly, or not at all, the latter two with a warning."""
    report_step(f"drawing {path.name}")
    if fault := _fault(scene):
        return _warned(f"{path.name}: not drawn: {fault}")
    plain = not opengl_works()
    most = _draw_plain.MOST_TRIANGLES if plain else _draw_opengl.MOST_TRIANGLES
    layers = tuple(thinned(layer, most) for layer in scene.layers)
    if any(a is not b for a, b in zip(layers, scene.layers, strict=True)):
        note = "triangles thinned out for this picture"
        caption = f"{scene.caption}; {note}" if scene.caption else note
        scene = replace(scene, layers=layers, caption=caption)
    try:
        picture = _draw_plain.draw_plain(scene) if plain else _draw_opengl.draw_opengl(scene)
    except (RuntimeError, ValueError, MemoryError) as cause:
        return _warned(f"{path.name}: not drawn: {cause}")
    write_bytes(path, picture)
    if plain:
        return _warned(f"{path.name}: no OpenGL on this machine, drawn plainly in less detail")
    return ()


def _fault(scene: Scene) -> str:
    """Why a scene cannot be drawn; VTK would show an empty picture without a word."""
    if not any(len(layer.faces) for layer in scene.layers):
        return "there are no triangles"
    for layer in scene.layers:
        if layer.values is not None and not np.isfinite(layer.values).all():
            return f"{np.count_nonzero(~np.isfinite(layer.values))} values are not finite"
        if not np.isfinite(layer.vertices).all():
            return "vertices are not finite"
    return ""


def _warned(warning: str) -> tuple[str, ...]:
    log.warning(warning)
    return (warning,)


def _diagonal(vertices: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))
