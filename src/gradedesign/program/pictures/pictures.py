"""The pictures of a run: loads, density, lattice, stress and deformed shape.

Above 300 lines: the pictures share one scene, one scale and one way to fail.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.atomic import write_bytes
from gradedesign.common.system.progress import report_step
from gradedesign.errors import MeshError
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets, centroids
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.pictures.action_mark import (
    SHORTEST,
    ActionMark,
    DrawnAction,
    drawn_actions,
    uses_floor,
)
from gradedesign.program.pictures.draw import draw
from gradedesign.program.pictures.label_places import separated
from gradedesign.program.pictures.region_mark import (
    COLOURS,
    HATCH,
    LIFT,
    ROLES,
    RegionMark,
    anchor_point,
    lifted,
    unit_normals,
)
from gradedesign.program.pictures.scene import (
    ColourBar,
    Label,
    Layer,
    LegendEntry,
    Lines,
    Scene,
    frame_of,
    hatch,
    sharp_edges,
)
from gradedesign.program.pictures.without_octant import without_octant

log = logging.getLogger(__name__)

_ABOVE, _SHADE = "#ff00c8", "#5b6470"
#: Displacement as drawn, in diagonals of the part. Chosen, not measured.
SHOWN_SHIFT = 0.08
#: Octant of the part that is cut away to look into it.
_TOWARDS_VIEWER = np.array([1.0, -1.0, 1.0])
#: Surfaces of more triangles are lattices: their edges at rest would cover everything.
_OUTLINED = 50_000


def picture_loads(
    path: Path,
    surface: SurfaceMesh,
    regions: Sequence[RegionMark],
    actions: Sequence[ActionMark] = (),
    *,
    title: str = "Loading",
    note: str = "",
) -> tuple[str, ...]:
    """Draw the part with its regions, and what acts on it in the colour of its load case.

    Returns tuple of str: warnings; a picture never fails a run.

    - ``path``: PNG
    - ``regions``: supports hatched. The legend names the roles that occur.
    - ``actions``: arrows as long as they are large, within a kind
    - ``title``, ``note``: the note stands below the picture
    """
    return _draw(path, _loads_scene(surface, regions, actions, title, note))


def loads_still(
    surface: SurfaceMesh,
    regions: Sequence[RegionMark],
    actions: Sequence[ActionMark],
    title: str,
    note: str,
) -> bytes | None:
    """The same picture as PNG bytes, for a page; None where it could not be drawn."""
    return _drawn(_loads_scene(surface, regions, actions, title, note), title)[0]


def surface_still(surface: SurfaceMesh, title: str) -> bytes | None:
    """A surface as PNG bytes, for a page; None where it could not be drawn."""
    layer = Layer(vertices=surface.vertices, faces=surface.faces, colour="#7f9fbf")
    return _drawn(Scene(title=title, layers=(layer,)), title)[0]


def _loads_scene(
    surface: SurfaceMesh,
    regions: Sequence[RegionMark],
    actions: Sequence[ActionMark],
    title: str,
    note: str,
) -> Scene:
    diagonal = _diagonal(surface.vertices)
    regions = [mark for mark in regions if len(mark.corners)]
    drawn = drawn_actions(actions, diagonal)
    # Last and translucent: regions on the far side show through.
    part = Layer(vertices=surface.vertices, faces=surface.faces, colour="#d5d9de", opacity=0.35)
    lines = [
        Lines(segments=hatch(lifted(mark, diagonal), HATCH * diagonal), colour="white")
        for mark in regions
        if mark.role == "support"
    ]
    lines += [line for action in drawn for line in action.lines]
    lines.append(Lines(segments=sharp_edges(part), colour="#555555", width=1.5))
    scene = Scene(
        title=title,
        caption="; ".join(part for part in (about_arrows(drawn, actions), note) if part),
        layers=(*(_region_layer(mark, diagonal) for mark in regions), part),
        lines=tuple(lines),
        arrows=tuple(arrow for action in drawn for arrow in action.arrows),
        legend=_loads_legend(regions, drawn),
    )
    labels, strokes = separated(
        _loads_labels(regions, drawn), frame_of(scene), scene.arrows, scene.legend
    )
    return replace(scene, labels=labels, lines=(*scene.lines, *strokes))


def _region_layer(mark: RegionMark, diagonal: float) -> Layer:
    above = lifted(mark, diagonal)
    faces = np.arange(3 * len(above)).reshape(-1, 3)
    return Layer(vertices=above.reshape(-1, 3), faces=faces, colour=COLOURS[mark.role])


def about_arrows(drawn: Sequence[DrawnAction], actions: Sequence[ActionMark]) -> str:
    """Note on the length of arrows, where there are several to compare."""
    if len(drawn) < 2:
        return ""
    floor = f", {SHORTEST:.0%} of the longest at least" if uses_floor(actions) else ""
    return f"arrows of one kind: length by size{floor}"


def _loads_labels(regions: Sequence[RegionMark], drawn: Sequence[DrawnAction]) -> list[Label]:
    labels = [
        Label(point=action.label, text=action.action.text, colour=action.colour) for action in drawn
    ]
    return labels + [
        Label(point=anchor_point(mark.corners), text=mark.name, colour=COLOURS[mark.role])
        for mark in regions
    ]


def _loads_legend(
    regions: Sequence[RegionMark], drawn: Sequence[DrawnAction]
) -> tuple[LegendEntry, ...]:
    """The roles and load cases that the picture shows, and no others."""
    shown_roles = {mark.role for mark in regions}
    roles = [LegendEntry(text=ROLES[r], colour=COLOURS[r]) for r in COLOURS if r in shown_roles]
    cases = {action.action.load_case: action.colour for action in drawn}
    return (*roles, *(LegendEntry(text=name, colour=colour) for name, colour in cases.items()))


def picture_density(path: Path, mesh: TetMesh, rho: FloatArray) -> tuple[str, ...]:
    """Draw element densities ``(m,)`` with the quarter towards the viewer cut away."""
    rho = np.asarray(rho, dtype=np.float64)
    middle = 0.5 * (mesh.points.min(axis=1) + mesh.points.max(axis=1))
    near = (_TOWARDS_VIEWER[:, None] * (centroids(mesh) - middle[:, None]) > 0.0).all(axis=0)
    kept = np.flatnonzero(~near)
    shown = TetMesh(points=mesh.points, tets=mesh.tets[:, kept])
    facets, owners = boundary_facets(shown)
    layer = Layer(vertices=mesh.points.T, faces=facets, values=rho[kept][owners], per_face=True)
    cut = ", the corner towards the viewer cut away" if len(kept) < len(rho) else ""
    scene = Scene(
        title="Relative density",
        caption=f"relative density {rho.min():.3g} to {rho.max():.3g}{cut}",
        layers=(layer,),
        bar=ColourBar(title="density [-]", low=float(rho.min()), high=float(rho.max())),
    )
    return _draw(path, scene)


def picture_lattice(
    path: Path, surface: SurfaceMesh, *, title: str = "Printed body", opened: bool = False
) -> tuple[str, ...]:
    """Draw the surface that is printed; opened, without the corner towards the viewer.

    A skin hides the lattice unless it is opened. Sections of very large surfaces stay open.
    """
    low, high = corners_of_box(surface.vertices)
    size = high - low
    caption = f"{len(surface.faces)} triangles, {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm"
    vertices, faces, warnings = surface.vertices, surface.faces, tuple[str, ...]()
    if opened:
        try:
            vertices, faces, capped = without_octant(surface, _TOWARDS_VIEWER, subject=path.name)
            caption += ", the corner towards the viewer cut away"
            caption += "" if capped else ", its sections open"
        except MeshError as error:
            warnings = (f"{path.name}: drawn without a cut: {error}",)
    layer = Layer(vertices=vertices, faces=faces, colour="#7f9fbf")
    return warnings + _draw(path, Scene(title=title, caption=caption, layers=(layer,)))


def picture_stress(
    path: Path,
    surface: SurfaceMesh,
    von_mises: FloatArray,
    *,
    limit: float | None = None,
    unjudged: BoolArray | None = None,
    title: str = "Stress",
) -> tuple[str, ...]:
    """Draw von Mises stress ``(n,)`` MPa at the vertices; above the limit in magenta.

    The bar ends at the limit. Where even the maximum is below half of it, or without a limit,
    it ends at the maximum. Triangles of ``unjudged`` vertices ``(n,)`` are shaded: stress counts in
    no limit there.
    """
    values = np.asarray(von_mises, dtype=np.float64)
    top = float(values.max())
    high = limit if limit is not None and top >= 0.5 * limit else top
    caption = f"maximum {top:.4g} MPa"
    if limit is not None:
        over = float(np.mean(values > limit))
        caption += f", limit {limit:.4g} MPa, "
        caption += (
            f"above it {100 * over:.2g} % of the vertices (magenta)" if over else "nowhere above it"
        )
    layer = Layer(vertices=surface.vertices, faces=surface.faces, values=values)
    bar = ColourBar(
        title="von Mises [MPa]",
        low=0.0,
        high=high,
        colours="turbo",
        above=_ABOVE if limit is not None and top > limit else None,
    )
    scene = Scene(title=title, caption=caption, layers=(layer,), bar=bar)
    if unjudged is not None and (shaded := unjudged[surface.faces].all(axis=1)).any():
        entry = LegendEntry(text="near held regions: not judged", colour=_SHADE)
        layers = (layer, _shade(surface, surface.faces[shaded]))
        scene = replace(scene, layers=layers, legend=(entry,))
    return _draw(path, scene)


def _shade(surface: SurfaceMesh, faces: IntArray) -> Layer:
    """Translucent layer just above triangles of a surface."""
    corners = surface.vertices[faces]
    lifted = corners + LIFT * _diagonal(surface.vertices) * unit_normals(corners)[:, None, :]
    return Layer(
        vertices=lifted.reshape(-1, 3),
        faces=np.arange(3 * len(faces)).reshape(-1, 3),
        colour=_SHADE,
        opacity=0.6,
    )


def picture_deformed(
    path: Path,
    surface: SurfaceMesh,
    displacement: FloatArray,
    *,
    title: str = "Deformed shape",
) -> tuple[str, ...]:
    """Draw the surface moved by a multiple of its displacement ``(3, n)`` mm.

    The largest displacement is drawn at about a twelfth of the diagonal, with a factor of 1, 2 or
    5 times a power of ten. The caption names the factor.
    """
    displacement = np.asarray(displacement, dtype=np.float64)
    size = np.linalg.norm(displacement, axis=0)
    factor = round_factor(SHOWN_SHIFT * _diagonal(surface.vertices), float(size.max()))
    moved = Layer(
        vertices=surface.vertices + factor * displacement.T, faces=surface.faces, values=size
    )
    lines: tuple[Lines, ...] = ()
    note = ""
    if len(surface.faces) <= _OUTLINED:
        edges = sharp_edges(Layer(vertices=surface.vertices, faces=surface.faces))
        lines = (Lines(segments=edges, colour="#888888", width=1.5),)
        note = "; grey edges: at rest" if len(edges) else ""
    scene = Scene(
        title=title,
        caption=f"deformation drawn x {factor:g}, largest displacement {size.max():.4g} mm{note}",
        layers=(moved,),
        lines=lines,
        bar=ColourBar(title="displacement [mm]", low=0.0, high=float(size.max()), colours="plasma"),
    )
    return _draw(path, scene)


def round_factor(wanted: float, largest: float) -> float:
    """Largest factor 1, 2 or 5 times a power of ten that keeps ``largest`` below ``wanted``."""
    if not largest > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted / largest))
    share = wanted / largest / power
    return float(power * max(n for n in (1, 2, 5) if n <= max(share, 1.0)))


def _draw(path: Path, scene: Scene) -> tuple[str, ...]:
    """Write a picture, or nothing; returns warnings."""
    picture, warnings = _drawn(scene, path.name)
    if picture is not None:
        write_bytes(path, picture)
    return warnings


def _drawn(scene: Scene, name: str) -> tuple[bytes | None, tuple[str, ...]]:
    """PNG of a scene; or a warning why there is none."""
    report_step(f"drawing {name}")
    if fault := _fault(scene):
        return None, _warned(f"{name}: not drawn: {fault}")
    try:
        return draw(scene), ()
    except (RuntimeError, ValueError, MemoryError) as cause:
        return None, _warned(f"{name}: not drawn: {cause}")


def _fault(scene: Scene) -> str:
    """Reason why a scene cannot be drawn, which would be an empty picture without a word."""
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
