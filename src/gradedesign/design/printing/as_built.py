"""The surface that a process builds of a printed one, and the one of which it builds the designed.

Facets are moved along their normals by the offset that the process has at their inclination. What
moves into itself stays a solid: inside is where the winding number of the moved surface is at least
1, as for every printed surface, so that gaps that close are joined and walls that shrink to nothing
vanish.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.design.printing.process import Process, surface_offset
from gradedesign.geometry.triangles.offset_surface import facet_normals, shifts_of
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles

#: Waves of a random field; its marginal is normal within about ``1 / sqrt(8 waves)``. Chosen, not
#: measured.
_WAVES = 256
#: Vertices whose random values are worked out at once: bounds the memory.
_CHUNK = 2**15
#: Normals of two neighbouring facets that belong to one smooth surface have at least this cosine,
#: 26 degrees; across sharper edges nothing is averaged. Chosen, not measured.
_SMOOTH = 0.9
#: Rounds in which offsets are averaged over neighbours, about two facets far: normals of single
#: facets of a contour scatter by some degrees. Chosen, not measured.
_ROUNDS = 10
#: Share of a step that the offsets of a compensated surface take, and most steps: an offset that
#: changes with inclination feeds back on the normals of neighbours, undamped without bound.
_DAMPING, _MOST_STEPS = 0.3, 30
#: Step, root mean square in mm, at which it is found: less than any offset is measured to.
_STILL = 5e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Building:
    """How a surface is built."""

    process: Process
    up: FloatArray  #: ``(3,)``. Build direction, of length 1.
    #: ``(m,)``. Facets that keep their place: the faces of the part, on whose size machines are
    #: calibrated and which mate with others, while tables of struts say nothing of them.
    held: BoolArray
    #: mm. Length over which the width of struts is alike: scatter is from strut to strut.
    strut: float
    links: IntArray  #: ``(2, k)``. Neighbouring facets of one smooth surface.


def building_on(
    surface: SurfaceMesh, process: Process, up: FloatArray, held: BoolArray, strut: float
) -> Building:
    """How a surface is built, with its smooth parts found; arguments as in `Building`."""
    edges = np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    key = edges[:, 0] * np.int64(len(surface.vertices)) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    links = np.stack([order[same], order[same + 1]]) // 3
    normals = facet_normals(surface)
    alike = np.einsum("ki,ki->k", normals[links[0]], normals[links[1]]) >= _SMOOTH
    links = links[:, alike & ~held[links].any(axis=0)]
    return Building(process=process, up=up, held=held, strut=strut, links=links)


def as_built_surface(
    surface: SurfaceMesh, building: Building, seed: int, *, scattered: bool = False
) -> SurfaceMesh:
    """The surface that is built: by the table of the process, wavy where it says so.

    ``seed``: of the waviness, and of the scatter. ``scattered``: whether the width also scatters
    from strut to strut, as in one sample of many.
    """
    more = np.zeros(len(surface.vertices))
    process = building.process
    if process.waviness is not None:
        wave = process.waviness
        more += wave.amplitude * _random_field(surface.vertices, wave.length, (seed, 1))
    if scattered and process.scatter is not None:
        # The width has two sides, which grow together.
        wide = _random_field(surface.vertices, building.strut, (seed, 2))
        more += 0.5 * process.scatter * wide
    return _moved(surface, _shifts(surface, building, more))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compensated:
    """A surface of which a process builds a designed one."""

    surface: SurfaceMesh
    #: Distance of the surface that is built of it from the designed one at its vertices: root mean
    #: square, and the one that 1 % exceed.
    rms_mm: float
    most_mm: float  #: As `rms_mm`.


def compensated_surface(surface: SurfaceMesh, building: Building) -> Compensated:
    """The surface of which a process builds this one, by its table, without waviness and scatter.

    The offset of every facet is that at the inclination it has on the compensated surface itself,
    found by damped iteration. What is left is measured on the surface that is built of the result:
    features no wider than what the process adds to them cannot be compensated.
    """
    area = np.linalg.norm(area_vectors(surface), axis=1)
    offsets, found = _offsets(surface, building), surface
    for _ in range(_MOST_STEPS):
        found = _moved(surface, -shifts_of(surface, np.repeat(offsets[:, None], 3, axis=1)))
        step = _offsets(found, building) - offsets
        offsets = offsets + _DAMPING * step
        if float(area @ step**2) <= _STILL**2 * float(area.sum()):
            break
    built = _moved(found, _shifts(found, building, np.zeros(len(found.vertices))))
    tree = build_triangle_tree(corner_points(surface))
    apart = closest_triangles(tree, built.vertices.T)[0]
    return Compensated(
        surface=found,
        rms_mm=float(np.sqrt((apart**2).mean())),
        most_mm=float(np.quantile(apart, 0.99)),
    )


def _offsets(surface: SurfaceMesh, building: Building) -> FloatArray:
    """Offset of every facet by the process, ``(m,)``, mm; none of those that are held.

    Averaged over neighbours: what flows from facet to facet leaves the mean by area as it is, so
    that the mean around a strut stays that of its table.
    """
    values = surface_offset(building.process, facet_normals(surface) @ building.up)
    values = np.where(building.held, 0.0, values)
    area = np.linalg.norm(area_vectors(surface), axis=1)
    one, other = building.links
    share = 0.25 * np.minimum(area[one], area[other])
    room = np.maximum(area, np.finfo(float).tiny)
    for _ in range(_ROUNDS):
        flow = share * (values[other] - values[one])
        gained = np.bincount(one, flow, len(area)) - np.bincount(other, flow, len(area))
        values = values + gained / room
    return np.asarray(values)


def _shifts(surface: SurfaceMesh, building: Building, more: FloatArray) -> FloatArray:
    """Shifts of the vertices ``(n, 3)`` by the process and further offsets of them ``(n,)``, mm."""
    further = np.where(building.held[:, None], 0.0, more[surface.faces])
    return shifts_of(surface, _offsets(surface, building)[:, None] + further)


def _moved(surface: SurfaceMesh, shifts: FloatArray) -> SurfaceMesh:
    """The surface with its vertices shifted."""
    return SurfaceMesh(vertices=surface.vertices + shifts, faces=surface.faces)


def _random_field(points: FloatArray, length: float, seed: tuple[int, int]) -> FloatArray:
    """Normal random values of variance 1 at points ``(n, 3)``, alike over a length in mm.

    A sum of plane waves whose wave vectors are drawn from the spectrum of the correlation
    ``exp(-(r / length)^2 / 2)``.

    References
    ----------
    M. Shinozuka, C.-M. Jan (1972), J. Sound Vib. 25, 111-128.
    """
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(_WAVES, 3)) / length
    phases = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    values = np.zeros(len(points))
    for k in range(0, len(points), _CHUNK):
        part = slice(k, k + _CHUNK)
        values[part] = np.cos(points[part] @ waves.T + phases).sum(axis=1)
    return np.sqrt(2.0 / _WAVES) * values
