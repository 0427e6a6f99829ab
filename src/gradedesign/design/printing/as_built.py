"""The surface that a process builds of a printed one, and the one of which it builds the designed.

Facets are moved along their normals by the offset that the process has at their inclination. What
moves into itself stays a solid: inside is where the winding number of the moved surface is at least
1, as for every printed surface, so that gaps that close are joined and walls that shrink to nothing
vanish.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.design.printing.process import Process, surface_offset
from gradedesign.geometry.triangles.offset_surface import facet_normals, shifts_of
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_triangles

#: Waves of a random field; its marginal is normal within about ``1 / sqrt(8 waves)``. Chosen, not
#: measured.
_WAVES = 256
#: Vertices whose random values are worked out at once: bounds the memory.
_CHUNK = 2**15
#: Share of a step that the offsets of a compensated surface take, rounds in which steps are
#: averaged over neighbours, and most steps: an offset that changes with inclination feeds back on
#: the normals of neighbouring facets, undamped without bound. On struts of 1 mm the width that is
#: built is right to 1 um after 30 steps by the table of an octet, 4 um after 8.
_DAMPING, _ROUNDS, _MOST_STEPS = 0.3, 3, 30
#: Averaged step, root mean square in mm, at which it is found: less than any offset is measured to.
_STILL = 5e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Building:
    """How a surface is built.

    Attributes
    ----------
    process : Process
    up : (3,) array
        Build direction, of length 1.
    held : (m,) bool array
        Facets that keep their place: the faces of the part, on whose size machines are calibrated
        and which mate with others, while tables of struts say nothing of them.
    strut : float, mm
        Length over which the width of struts is alike: scatter is from strut to strut.
    """

    process: Process
    up: FloatArray
    held: BoolArray
    strut: float


def as_built_surface(
    surface: SurfaceMesh, building: Building, seed: int, *, scattered: bool = False
) -> SurfaceMesh:
    """The surface that is built: by the table of the process, wavy where it says so.

    Parameters
    ----------
    seed : int
        Of the waviness, and of the scatter.
    scattered : bool
        Whether the width also scatters from strut to strut, as in one sample of many.
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
    """A surface of which a process builds a designed one.

    Attributes
    ----------
    rms_mm, most_mm : float
        Distance of the surface that is built of it from the designed one at its vertices: root mean
        square, and the one that 1 % exceed.
    """

    surface: SurfaceMesh
    rms_mm: float
    most_mm: float


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
        step = _averaged(surface, _offsets(found, building) - offsets, area)
        step[building.held] = 0.0
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


def _averaged(surface: SurfaceMesh, values: FloatArray, area: FloatArray) -> FloatArray:
    """Values of facets ``(m,)``, averaged over their neighbours by area some times."""
    count = len(surface.vertices)
    around = np.zeros(count)
    for k in range(3):
        around += np.bincount(surface.faces[:, k], area, count)
    for _ in range(_ROUNDS):
        total = np.zeros(count)
        for k in range(3):
            total += np.bincount(surface.faces[:, k], area * values, count)
        values = (total / np.maximum(around, np.finfo(float).tiny))[surface.faces].mean(axis=1)
    return values


def _offsets(surface: SurfaceMesh, building: Building) -> FloatArray:
    """Offset of every facet by the process, ``(m,)``, mm; none of those that are held."""
    offsets = surface_offset(building.process, facet_normals(surface) @ building.up)
    return np.where(building.held, 0.0, offsets)


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
