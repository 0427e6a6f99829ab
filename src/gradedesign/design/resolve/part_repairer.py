"""The installed repairer that a case names, as reading its part takes it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.worker import run_worker
from gradedesign.common.values.locate import Where
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.resolve.rebuilt import rebuilt
from gradedesign.design.resolve.registry import Registry, absent
from gradedesign.errors import CaseError, MeshError, PartError
from gradedesign.geometry.part.mended import Mend
from gradedesign.geometry.part.part_schema import OWN_REPAIRS, REBUILD, PartSpec
from gradedesign.geometry.part.repairer import Repairer
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def part_repairer(spec: PartSpec, budget: RunSpec, registry: Registry, where: Where) -> Mend | None:
    """Repairer of the surface of the part; None where gradedesign does.

    Raises
    ------
    CaseError
        For an unknown repairer or option.
    PluginError
        The same, when a plugin that might have supplied it is disabled.
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
