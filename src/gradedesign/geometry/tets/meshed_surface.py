"""Mesh the inside of a surface in a process that may fail, and check the result."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.cache import content_key, entry_path, load_arrays, store_arrays
from gradedesign.common.system.limits import Deadline
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.worker import Option, run_worker
from gradedesign.errors import MeshError, ResourceError
from gradedesign.geometry.tets.long_edges import bisect_long_edges, least_count
from gradedesign.geometry.tets.mesher import PYTETWILD, Mesher
from gradedesign.geometry.tets.quality import TetReport, require_sound, without_unused_points
from gradedesign.geometry.tets.tet_mesh import TetMesh
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    enclosed_volume,
    unbalanced_edge_count,
)

log = logging.getLogger(__name__)

_KIND = "tetwild"
_FAILED_KIND = "tetwild-failed"
#: Longest edge over the target length: where fTetWild splits edges (Hu et al. 2020, 3.2).
LONGEST_EDGE = 4.0 / 3.0
#: Of bisection: tetrahedra for one of the least number, and bytes for each of them, measured at
#: 0.07 to 0.84 million.
_BISECTED, _BYTES_PER_TET = 5.4, 430.0
#: A process gets no less time than this, s: time may run out between the check and its start.
#: Chosen, not measured.
_LEAST_S = 0.001
#: How the line of an attempt says that it is the last one.
_SUCCEEDED = "succeeded in"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshedSurface:
    """Tetrahedra of the inside of a surface, checked."""

    mesh: TetMesh
    report: TetReport  #: Volume, angles and the number of pieces.
    #: One line for each attempt; the last one succeeded. Of a mesh from the cache, those of the run
    #: that made it.
    attempts: tuple[str, ...]
    seconds: float  #: Wall time of this call.


def failed_attempts(attempts: Sequence[str]) -> tuple[str, ...]:
    """Lines of the attempts, of one mesh or of several, that had to be retried.

    Examples
    --------
    >>> failed_attempts(["all threads: timed out", "one thread: succeeded in 3.1 s"])
    ('all threads: timed out',)
    """
    return tuple(line for line in attempts if f": {_SUCCEEDED} " not in line)


def tetrahedralize(
    surface: SurfaceMesh,
    *,
    edge_length: float,
    epsilon: float,
    time_limit_s: float,
    memory_limit_bytes: int,
    volume_tolerance: float = 0.01,
    cache: bool = True,
    mesher: Mesher = PYTETWILD,
) -> MeshedSurface:
    """Mesh the inside of a closed surface with tetrahedra.

    fTetWild stops as soon as its tetrahedra are well shaped, on a box before they reach the target
    length. Whatever the mesher, tetrahedra with an edge longer than 4/3 of the target are bisected.

    fTetWild is not deterministic, so a surface that was meshed before is read from the user's
    cache. A crash or a refused mesh is retried with the mesher's other option sets, which share the
    geometric tolerance.

    Raises MeshError if the surface is empty, open or inside out, all attempts fail, or time runs
    out. Raises ResourceError if the mesher needs more memory.

    - ``surface``: closed, outward oriented
    - ``edge_length``: target, mm; no edge is longer than 4/3 of it
    - ``epsilon``: how far the mesh may lie from the surface, mm
    - ``time_limit_s``: for all attempts together, s
    - ``memory_limit_bytes``: of the mesher's process
    - ``volume_tolerance``: largest relative difference from the volume that the surface encloses
    - ``cache``: use and fill the user's cache
    - ``mesher``: what runs in the process
    """
    clock = Deadline(time_limit_s)
    question = mesh_question(surface, edge_length, epsilon, volume_tolerance)
    key = content_key(
        surface.vertices,
        surface.faces,
        edge_length,
        epsilon,
        STOP_ENERGY,
        mesher.version,
        mesher.worker,
        LONGEST_EDGE,
    )
    cached = _from_cache(question, key) if cache else None
    if cached is None:
        log.info("meshing %s", question.subject)
        mesh, report, attempts = _attempt(question, key, clock, memory_limit_bytes, mesher)
        log.info("meshed: %d tetrahedra in %.1f s", report.count, clock.elapsed())
    else:
        mesh, report, attempts = cached
    if cache and cached is None:
        lines = np.frombuffer(json.dumps(attempts).encode("utf-8"), dtype=np.uint8)
        store_arrays(_KIND, key, points=mesh.points, tets=mesh.tets, attempts=lines)
    return MeshedSurface(mesh=mesh, report=report, attempts=attempts, seconds=clock.elapsed())


def _attempt(
    question: MeshQuestion,
    key: str,
    clock: Deadline,
    memory_limit_bytes: int,
    mesher: Mesher,
) -> tuple[TetMesh, TetReport, tuple[str, ...]]:
    """Run the mesher with each of its option sets until a mesh passes the checks."""
    attempts: list[str] = []
    for number, (way, options) in enumerate(mesher.ways, start=1):
        clock.require(f"meshing {question.subject}")
        start = clock.elapsed()
        report_step(f"mesher, way {number} of {len(mesher.ways)}: {way}")
        try:
            result = run_worker(
                mesher.worker,
                {"vertices": question.vertices, "faces": question.faces},
                {**question.options, **options},
                time_limit_s=max(clock.remaining(), _LEAST_S),
                memory_limit_bytes=memory_limit_bytes,
            )
            mesh, report = _checked(question, result.arrays, memory_limit_bytes)
        except ResourceError as cause:
            raise ResourceError(f"meshing {question.subject}: {cause}") from cause
        except MeshError as cause:
            attempts.append(f"{way}: {cause}")
            log.warning("attempt %d at meshing failed: %s: %s", len(attempts), way, cause)
            if clock.expired():
                break
        else:
            attempts.append(f"{way}: {_SUCCEEDED} {clock.elapsed() - start:.1f} s")
            return mesh, report, tuple(attempts)
    raise _given_up(question, key, attempts)


def _given_up(question: MeshQuestion, key: str, attempts: list[str]) -> MeshError:
    """Error of a mesh that failed in every attempt; its input is stored for reproduction."""
    store_arrays(
        _FAILED_KIND,
        key,
        vertices=question.vertices,
        faces=question.faces,
        options=np.frombuffer(json.dumps(dict(question.options)).encode("utf-8"), dtype=np.uint8),
    )
    tried = "; ".join(f"attempt {number}: {text}" for number, text in enumerate(attempts, start=1))
    return MeshError(
        f"meshing {question.subject} failed, attempts with the same tolerance: {len(attempts)}; "
        f"{tried}; repair the surface, choose another mesh size, or raise run.time; to reproduce: "
        f"{entry_path(_FAILED_KIND, key)}"
    )


def _checked(
    question: MeshQuestion, arrays: Mapping[str, NDArray[Any]], memory_limit_bytes: int
) -> tuple[TetMesh, TetReport]:
    """Check the mesher's tetrahedra, move them back to the surface and bisect their long edges."""
    if not {"points", "tets"} <= arrays.keys():
        raise MeshError(f"the mesher returned {sorted(arrays)}, expected points and tets")
    points, tets = arrays["points"], arrays["tets"]
    if tets.size == 0:
        raise MeshError("the mesher returned no tetrahedra")
    try:
        mesh = TetMesh(points=points.T + question.centre[:, None], tets=tets.T)
    except ValueError as cause:
        raise MeshError(f"the mesher returned a broken mesh: {cause}") from cause
    mesh = without_unused_points(mesh)
    _sound(question, mesh)  # bisection takes a conforming mesh of positive volumes for granted
    longest = LONGEST_EDGE * float(question.options["edge_length"])
    count = _BISECTED * least_count(question.volume, longest)
    if count * _BYTES_PER_TET > memory_limit_bytes:
        raise ResourceError(
            f"no edge above {longest:.3g} mm takes about {count:.2g} tetrahedra, about "
            f"{count * _BYTES_PER_TET / 1e9:.2g} GB to make; found a limit of "
            f"{memory_limit_bytes / 1e9:.2g} GB; choose a larger mesh size or raise run.memory"
        )
    mesh = bisect_long_edges(mesh, longest)
    return mesh, _sound(question, mesh)


def _sound(question: MeshQuestion, mesh: TetMesh) -> TetReport:
    """Check volume and orientation."""
    return require_sound(
        mesh,
        subject="the mesher's result",
        expected_volume=question.volume,
        volume_tolerance=question.volume_tolerance,
    )


def _from_cache(
    question: MeshQuestion, key: str
) -> tuple[TetMesh, TetReport, tuple[str, ...]] | None:
    """Return the answer given before, if it still passes the checks."""
    stored = load_arrays(_KIND, key)
    if stored is None:
        return None
    try:
        mesh = TetMesh(points=stored["points"], tets=stored["tets"])
        report = _sound(question, mesh)
        attempts = tuple(str(line) for line in json.loads(stored["attempts"].tobytes()))
    except (MeshError, KeyError, ValueError) as cause:
        log.warning("the cached mesh is of no use (%s); meshing again", cause)
        return None
    return mesh, report, attempts


#: Quality at which fTetWild stops improving (AMIPS energy). fTetWild's own default (Hu et al.
#: 2020).
STOP_ENERGY = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshQuestion:
    """A surface, moved to the origin, with the specification of its mesh."""

    vertices: FloatArray
    faces: NDArray[np.int32]
    centre: FloatArray
    options: Mapping[str, Option]
    volume: float
    volume_tolerance: float
    subject: str


def mesh_question(
    surface: SurfaceMesh,
    edge_length: float,
    epsilon: float,
    volume_tolerance: float,
) -> MeshQuestion:
    """Refuse surfaces that would crash the mesher or give a meaningless mesh; move to the origin.

    Raises `MeshError`.
    """
    for name, value in (("edge length", edge_length), ("epsilon", epsilon)):
        if not (value > 0.0 and np.isfinite(value)):
            raise MeshError(f"the {name} of a mesh must be positive, not {value} mm")
    if len(surface.faces) == 0:
        raise MeshError("the surface has no triangles, so there is nothing to mesh")
    open_edges = unbalanced_edge_count(surface)
    if open_edges:
        raise MeshError(
            f"the surface is not closed: {open_edges} edges lack a neighbour of opposite "
            "direction, so it encloses no volume; repair it first"
        )
    volume = enclosed_volume(surface)
    if not volume > 0.0:
        raise MeshError(
            f"the surface encloses {volume:.6g} mm^3, expected a positive volume; its triangles "
            "must be counter-clockwise seen from outside"
        )
    corners = surface.vertices[np.unique(surface.faces)]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    diagonal = float(np.linalg.norm(upper - lower))
    centre = 0.5 * (lower + upper)
    return MeshQuestion(
        vertices=surface.vertices - centre,
        faces=surface.faces.astype(np.int32),
        centre=centre,
        options={
            "edge_length": edge_length,
            "relative_epsilon": epsilon / diagonal,
            "stop_energy": STOP_ENERGY,
        },
        volume=volume,
        volume_tolerance=volume_tolerance,
        subject=f"a surface of {len(surface.faces)} triangles, {diagonal:.4g} mm across, with "
        f"edges of {edge_length:.4g} mm and epsilon {epsilon:.4g} mm",
    )
