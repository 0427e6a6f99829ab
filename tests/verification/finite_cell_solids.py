"""Solids, regions and load cases for the tests of finite cells."""

from types import SimpleNamespace

import numpy as np

from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec, LoadSpec
from gradedesign.mechanics.finite_cell.analysis import divide, solve_divided
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem, require_regions
from gradedesign.mechanics.finite_cell.recovery import recovered_stress
from gradedesign.mechanics.finite_cell.result import solution_of
from gradedesign.mechanics.finite_cell.stress import displacement_at as displacement_in
from gradedesign.mechanics.finite_cell.stress import solid_points
from gradedesign.mechanics.finite_cell.surface import element_table, locate
from gradedesign.mechanics.material.material import Material

STEEL = Material(
    name="steel", youngs_modulus=200e3, poissons_ratio=0.3, density=7.8e-9, yield_strength=300.0
)


def region(name, corners):
    """A region of triangles ``(k, 3, 3)``."""
    corners = np.asarray(corners, dtype=np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    return Region(
        name=name,
        triangles=np.arange(len(corners)),
        corners=corners,
        area=float(area.sum()),
        centroid=area @ corners.mean(axis=1) / area.sum(),
        faces=(0,),
    )


def box_face(name, lower, upper, axis, side):
    """A face of a box as two triangles, normal outward."""
    low, high = np.array(lower, float), np.array(upper, float)
    b, c = (axis + 1) % 3, (axis + 2) % 3
    quad = np.tile(low, (4, 1))
    quad[:, axis] = (low, high)[side][axis]
    quad[1:3, b] = high[b]
    quad[2:4, c] = high[c]
    if not side:
        quad = quad[::-1]
    return region(name, [quad[[0, 1, 2]], quad[[0, 2, 3]]])


def box_regions(lower, upper):
    """The six faces of a box, named x0 to z1."""
    return {
        f"{'xyz'[axis]}{side}": box_face(f"{'xyz'[axis]}{side}", lower, upper, axis, side)
        for axis in range(3)
        for side in range(2)
    }


def box_field(lower, upper):
    """Distance-like field of a box."""
    low, high = (np.array(p, float) for p in (lower, upper))

    def field(points):
        shape = (3, *[1] * (points.ndim - 1))
        return np.maximum(low.reshape(shape) - points, points - high.reshape(shape)).max(axis=0)

    return field


def newtons(*values):
    return [f"{v!r} N" for v in values]


def load_case(name, fix, load, **others):
    """A load case from (region, components) and (region, keys) pairs."""
    return LoadCaseSpec(
        name=name,
        fix=[FixSpec(region=r, components=c) for r, c in fix],
        load=[LoadSpec(region=r, **keys) for r, keys in load],
        **others,
    )


def problem(field, lower, upper, cases, regions, material=STEEL, **others):
    return CutProblem(
        field=field, lower=lower, upper=upper, cases=tuple(cases), regions=regions,
        material=material, **others,
    )  # fmt: skip


def analyse(solid, spacing, **settings):
    """Solve every load case of a solid on finite cells of a spacing."""
    require_regions(solid)
    return solve_divided(solid, *divide(solid, spacing), **settings)


def stress_sample(result, name):
    """Points of the solid, the volumes that they stand for, and the stress of a load case there."""
    solution, at = solution_of(result, name), solid_points(result.elements)
    stress = recovered_stress(
        result.elements, result.space, solution.u, result.moduli, at, solution.thermal_strain
    )
    return SimpleNamespace(points=at.points, volume=at.volume, stress=stress)


def displacement_at(result, name, points):
    """Displacement of a load case at points ``(3, m)`` of the solid."""
    element = locate(result.elements, element_table(result.elements), points)
    assert (element >= 0).all(), "points outside the solid"
    u = solution_of(result, name).u
    return displacement_in(result.elements, result.space, u, element, points)


def displacement_on(result, place, name, component):
    """Largest displacement of a region's solid, magnitude or absolute component."""
    u = result.region_displacement(place, name)
    return float((np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])).max())


def gyroid_sheet(level, cells, offset=(0.0, 0.0, 0.0)):
    """Gyroid sheet of unit cells in a box, with solid plates of an eighth at both ends of x.

    Level 0.4639 has relative density 0.3; the offset moves the sheet, not the box and the plates.
    """
    box = box_field((0, 0, 0), cells)

    def field(points):
        x, y, z = (2 * np.pi * (axis + move) for axis, move in zip(points, offset, strict=True))
        g = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
        plate = np.minimum(points[0], cells[0] - points[0]) - 0.125
        return np.maximum(np.minimum((np.abs(g) - level) / 8.0, plate), box(points))

    return field
