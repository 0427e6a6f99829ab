"""Cell map of graded size: the size follows the density."""

from __future__ import annotations

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.maps.cell_map import CellMap, constant_jacobian, turned_axes
from gradedesign.geometry.maps.phase_fields import default_spacing, graded_size_map
from gradedesign.geometry.maps.size_law import size_field_by_ratio, size_field_for_wall
from gradedesign.geometry.part.part import Part

#: Iterations in which cells may turn in order to keep size and shape. Chosen, not measured.
_ROTATION_FREE = 3


def require_one_thickness(lattice: LatticeSpec, where: Where, family: CellFamily) -> None:
    """Refuse ``grading = "thickness"`` of cells whose walls have no one thickness.

    Raises `CaseError`.
    """
    if lattice.grading == "thickness" and not family.distance:
        with locating(where, "lattice.grading"):
            raise CaseError(
                f'grading = "thickness" needs walls of one thickness in each cell, which '
                f"'{family.name}' does not have; take a cell whose name ends in -wall "
                f'or a strut cell, or grading = "level"'
            )


def wanted_size(
    spec: LatticeSpec,
    cell: Cell,
    density: DensityGrid,
    ends: tuple[float, float],
) -> Field:
    """Cell size that follows from the density, points ``(3, ...)`` mm to ``(...)`` mm.

    ``ends``, (float, float): densities of the largest and of the smallest cells, where wall and
    size both follow.
    """
    sizes = (spec.size[0], spec.size[-1])

    def rho(points: FloatArray) -> FloatArray:
        return evaluate(density, points)

    if spec.wall is not None:
        return size_field_for_wall(rho, cell, spec.wall, sizes)
    return size_field_by_ratio(rho, cell, sizes, ends)


def graded_map(
    spec: LatticeSpec, where: Where, part: Part, wanted: Field, frames: Field | None = None
) -> CellMap:
    """Phase fields of cells of the wanted size, from the case's origin and along its axes.

    ``wanted``: points ``(3, ...)`` mm to sizes ``(...)``, mm. ``frames``: points to rotations
    ``(3, 3, ...)`` whose rows the cells follow, instead of the axes of the case; they are held,
    where free cells turn to keep their size. Raises `CaseError`, `DensityError`, `ResourceError` as
    `graded_size_map`.
    """
    corners = part.surface.vertices
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    axes = turned_axes(spec.rotation)

    def frame(points: FloatArray) -> FloatArray:
        return constant_jacobian(axes.T, points)

    with locating(where, "lattice.size"):
        return graded_size_map(
            wanted,
            lower,
            upper,
            spacing=default_spacing(lower, upper, spec.cell_size),
            frame_of=frames or (frame if any(spec.rotation) else None),
            iterations=_ROTATION_FREE if frames is None else 0,
            origin=spec.origin if "origin" in spec.model_fields_set else None,
        )
