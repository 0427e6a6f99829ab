"""The cell map of a case: straight, about an axis or centre, in layers, warped."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field
from gradedesign.common.values.locate import Where, locating
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.maps.cell_map import CellMap, turned_axes, uniform_map
from gradedesign.geometry.maps.cell_map_schema import CellMapSpec
from gradedesign.geometry.maps.conformal_map import conformal_map, layered_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.spherical_map import spherical_map
from gradedesign.geometry.maps.warp_map import MorphingSphere, warp_map
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.regions_schema import direction_vector
from gradedesign.geometry.part.signed_distance import region_distance

#: Points in the part's box at which a map is measured.
REPORT_POINTS = 40_000
_SIZE = "lattice.size"


def placed_map(lattice: LatticeSpec, where: Where, part: Part, distance: Field) -> CellMap:
    """Map of cells that are not graded in size.

    Raises CaseError if the map is impossible.

    ``distance``: signed distance of the part.
    """
    with locating(where, map_key(where)):
        return _warped(lattice, where, _map_of_kind(lattice, part, distance))


def map_key(where: Where) -> str:
    """The key of a case that makes its cells other than a straight grid of one size."""
    stated = ("cell_map", "warp")
    return next((f"lattice.{key}" for key in stated if f"lattice.{key}" in where.lines), _SIZE)


def _warped(lattice: LatticeSpec, where: Where, cell_map: CellMap) -> CellMap:
    """The map with its morphing spheres."""
    spheres = [
        MorphingSphere(
            centre=np.array(w.centre),
            stable_radius=w.stable_radius,
            outer_radius=w.outer_radius,
            magnification=w.magnification,
        )
        for w in lattice.warp
    ]
    if not spheres:
        return cell_map
    with locating(where, "lattice.warp"):
        return warp_map(cell_map, spheres)


def _map_of_kind(spec: LatticeSpec, part: Part, distance: Field) -> CellMap:
    """The map without warps."""
    map_spec = spec.cell_map
    if map_spec is None:
        rotation = turned_axes(spec.rotation) if any(spec.rotation) else None
        return uniform_map(spec.edges, spec.origin, rotation)
    if map_spec.kind in ("conformal", "layered"):
        return _in_layers(spec, map_spec, part, distance)
    size, around, inner = spec.cell_size, map_spec.around, map_spec.inner_radius
    if around is None or inner is None:
        raise CaseError(f"a {map_spec.kind} map needs around and inner_radius")
    if map_spec.kind == "cylindrical":
        return cylindrical_map(
            around=around,
            radial_size=size,
            axial_size=size,
            inner_radius=inner,
            origin=map_spec.centre,
            axis=direction_vector(map_spec.axis),
        )
    return spherical_map(
        around=around,
        pole_to_pole=around // 2,
        radial_size=size,
        inner_radius=inner,
        polar_cap=map_spec.polar_cap,
        origin=map_spec.centre,
        axis=direction_vector(map_spec.axis),
    )


def _in_layers(spec: LatticeSpec, map_spec: CellMapSpec, part: Part, distance: Field) -> CellMap:
    """Layers from a surface, or between two."""
    normal = direction_vector(map_spec.normal)
    if map_spec.kind == "conformal":
        return conformal_map(
            _depth(map_spec.surface, part, distance), spec.edges, normal=normal, origin=spec.origin
        )
    if map_spec.layers is None:
        raise CaseError("a layered map needs layers")
    return layered_map(
        _depth(map_spec.surface, part, distance),
        _depth(map_spec.opposite, part, distance),
        map_spec.layers,
        spec.edges[:2],
        normal=normal,
        origin=spec.origin,
    )


def _depth(region: str | None, part: Part, distance: Field) -> Field:
    """Distance into the part from its surface, or from one region of it."""
    if region is not None:
        return region_distance(part.regions[region].corners)
    return lambda points: -distance(points)
