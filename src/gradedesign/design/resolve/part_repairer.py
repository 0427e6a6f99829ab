"""The installed repairer that a case names, as reading its part takes it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.system.worker import run_worker
from gradedesign.common.values.locate import Where
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.resolve.registry import Registry, absent
from gradedesign.errors import CaseError, MeshError, PartError, ResourceError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.part.mended import Mend
from gradedesign.geometry.part.part_schema import OWN_REPAIRS, REBUILD, PartSpec
from gradedesign.geometry.part.repairer import Repairer
from gradedesign.geometry.triangles.distance_grid import distance_grid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def part_repairer(spec: PartSpec, budget: RunSpec, registry: Registry, where: Where) -> Mend | None:
    """Repairer of the surface of the part; None where gradedesign does.

    Raises `CaseError` for an unknown repairer or option. Raises `PluginError`: the same, when a
    plugin that might have supplied it is disabled.
    """
    name, options = spec.repair, spec.repair_options
    if name == REBUILD:
        return _rebuild(options, budget.memory, where("part.repair_options"))
    if name in OWN_REPAIRS:
        if options:
            raise CaseError(
                f'{where("part.repair_options")}: repair = "{name}" has no options; '
                f'expected repair = "{REBUILD}" or the repairer of a plugin'
            )
        return None
    repairer = registry.repairers.get(name)
    if repairer is None:
        near = supplied_by("repairers", name) or instead(name, (*OWN_REPAIRS, *registry.repairers))
        raise absent(registry, f"{where('part.repair')}: found {shown(name)}; {near}")
    for key in options:
        if key not in repairer.options:
            near = instead(key, repairer.options, label="its options")
            raise CaseError(
                f"{where(f'part.repair_options.{key}')}: '{name}' has no such option; {near}"
            )
    return _process_repair(repairer, options, budget)


def _rebuild(options: Mapping[str, Any], memory: int, where: str) -> Mend:
    """Rebuild the surface on the grid that the options state, within the memory, bytes."""
    spacing = options.get("spacing")
    if set(options) != {"spacing"} or isinstance(spacing, bool | str) or not spacing:
        raise CaseError(
            f'{where}: repair = "{REBUILD}" takes the spacing of a grid and nothing else, found '
            f'{shown(dict(options))}; write spacing = "0.5 mm", half of the thinnest wall'
        )

    def mend(
        vertices: FloatArray, faces: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], Mapping[str, int]]:
        made = rebuilt(
            SurfaceMesh(vertices=vertices, faces=faces),
            float(spacing),
            memory_limit_bytes=memory,
            where=where,
        )
        return made.vertices, made.faces, {"triangles_rebuilt": len(made.faces)}

    return mend


def _process_repair(repairer: Repairer, options: Mapping[str, Any], budget: RunSpec) -> Mend:
    """Ask the repairer in a process of its own, within the budgets."""

    def mend(
        vertices: FloatArray, faces: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], Mapping[str, int]]:
        try:
            arrays = run_worker(
                repairer.worker,
                {"vertices": vertices, "faces": faces},
                options,
                time_limit_s=budget.time,
                memory_limit_bytes=budget.memory,
            ).arrays
        except MeshError as error:
            raise PartError(f"repairer '{repairer.name}': {error}") from error
        return arrays["vertices"], arrays["faces"], json.loads(arrays["changes"].tobytes())

    return mend


#: Empty grid steps around the part, so that its surface closes.
_MARGIN = 3
#: Bytes a node that the distance and its surface take.
_BYTES_PER_NODE = 12
#: Grid steps along the longest edge of the part, at least. Chosen, not measured.
_LEAST_STEPS = 10


def rebuilt(
    surface: SurfaceMesh, spacing: float, *, memory_limit_bytes: int, where: str
) -> SurfaceMesh:
    """Closed surface where the signed distance to triangles vanishes.

    Inside is where they wind around a point by more than one half. Faces move by a part of the
    spacing where they are curved, edges are chamfered by half of it, and what is thinner than two
    steps may be lost.

    Raises CaseError if the grid is as coarse as the part. Raises ResourceError if the grid takes
    more memory.

    ``surface``: with holes, doubled or turned triangles, or parts that pass through each other.
    ``spacing``, mm: of the grid. ``where``: the key of the case, for messages.
    """
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    if (upper - lower).max() < _LEAST_STEPS * spacing:
        raise CaseError(
            f"{where}: found a spacing of {spacing:g} mm for a part of "
            f"{' x '.join(f'{e:.4g}' for e in upper - lower)} mm; expected a {_LEAST_STEPS}th of "
            f"its longest edge at most"
        )
    # Half a spacing off the part's own planes, which often lie at round numbers.
    origin = lower - (_MARGIN + 0.5) * spacing
    steps = np.ceil((upper - origin) / spacing) + _MARGIN + 1
    need = _BYTES_PER_NODE * float(steps.prod())
    if need > memory_limit_bytes:
        raise ResourceError(
            f"{where}: a grid of {spacing:g} mm takes {need / 1e9:.3g} GB; found run.memory of "
            f"{memory_limit_bytes / 1e9:.3g} GB; raise it or take a larger spacing"
        )
    x, y, z = (int(n) for n in steps)
    report_step("signed distance of the triangles")
    values = distance_grid(surface, origin, spacing, (x, y, z))

    def field(points: FloatArray) -> FloatArray:
        index = (np.asarray(points).reshape(3, -1) - origin[:, None]) / spacing
        distances = map_coordinates(values, index, order=1, mode="nearest", output=np.float64)
        return np.asarray(distances).reshape(points.shape[1:])

    # The surface's nodes lie half a spacing below the box that it is cut at.
    return extract_surface(field, origin + 1.5 * spacing, origin + (steps - 2.0) * spacing, spacing)
