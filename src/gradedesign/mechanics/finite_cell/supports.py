"""Supports: strong where a region covers faces of elements, by stiff springs elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import CaseError, SolverError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_case import LoadCaseSpecification, Support
from gradedesign.mechanics.fe.supports import disagrees
from gradedesign.mechanics.finite_cell.basis import shapes_at
from gradedesign.mechanics.finite_cell.elements import Elements, sorted_by_colour
from gradedesign.mechanics.finite_cell.hanging import fill_hanging, gather_hanging
from gradedesign.mechanics.finite_cell.operator import Springs
from gradedesign.mechanics.finite_cell.space import LOCAL, BrickSpace, node_points
from gradedesign.mechanics.finite_cell.surface import (
    SurfacePoints,
    brick_of,
    element_table,
    split_by_grid,
)
from gradedesign.mechanics.solver.rigid_modes import free_modes

#: Stiffness of the springs of a weak support, over the P-wave modulus and per edge of an element. A
#: short cantilever on such springs is 0.14 to 0.18 % too soft.
_SPRING = 400.0
#: A triangle this close to a grid plane, over the edge, lies on it. Chosen, not measured.
ON_PLANE = 1e-6
#: Share of an element's face from which a region covers it. Chosen, not measured.
COVERED = 1.0 - 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Held:
    """Supports of one load case."""

    fixed: BoolArray  #: ``(N, 3)``.
    #: ``(N, 3)``, mm. Prescribed displacement; 0 where nothing is. None where all is 0.
    value: FloatArray | None
    springs: Springs | None
    #: ``(N, 3)``, N. Of springs whose far ends move as prescribed. None where none does.
    spring_force: FloatArray | None
    #: N mm. Energy of these springs if the solid stayed where it is.
    spring_energy: float


def support_key(case: LoadCaseSpecification) -> tuple[tuple[str, tuple[bool, ...]], ...]:
    """Regions and held components: equal for load cases that can share a set-up."""
    return tuple(sorted((f.region, tuple(d is not None for d in f.displacement)) for f in case.fix))


def held_by(
    elements: Elements,
    space: BrickSpace,
    case: LoadCaseSpecification,
    regions: Mapping[str, Region],
    places: Mapping[str, SurfacePoints],
    modulus: float,
) -> Held:
    """Supports of a load case.

    Raises `CaseError` if two supports prescribe a node differently, and `SolverError` if the
    supports leave rigid motions free.

    ``regions``: by name. ``places``: by name; where the solid reaches the regions. ``modulus``,
    MPa: p-wave modulus of the solid.
    """
    count = len(space.place)
    fixed = np.zeros((count, 3), dtype=bool)
    value = np.zeros((count, 3))
    blocks: dict[int, FloatArray] = {}
    force, energy = np.zeros((count, 3)), 0.0
    seen: list[tuple[FloatArray, tuple[bool, ...]]] = []
    for fix in case.fix:
        strong = _held_alone(space, _covered_faces(elements, regions[fix.region]))
        nodes = _face_nodes(space, strong)
        for c, prescribed in enumerate(fix.displacement):
            if prescribed is not None:
                _refuse_conflict(fixed[nodes, c], value[nodes, c], prescribed, fix.region)
                fixed[nodes, c] = True
                value[nodes, c] = prescribed
        at = places[fix.region]
        weak = ~np.isin(_face_codes(at), strong)
        energy += _add_springs(elements, space, fix, at, weak, modulus, blocks, force)
        held = tuple(prescribed is not None for prescribed in fix.displacement)
        seen.append((at.points[:, weak], held))
    _require_held(elements, space, fixed, seen, case.name)
    fill_hanging(space.hanging, value)
    gather_hanging(space.hanging, force)
    return Held(
        fixed=fixed,
        value=value if value.any() else None,
        springs=_collected(elements, blocks),
        spring_force=force if force.any() else None,
        spring_energy=energy,
    )


def _covered_faces(elements: Elements, region: Region) -> IntArray:
    """Faces of elements that a region covers, as 6 element + 2 axis + side."""
    grid = elements.grid
    triangles = split_by_grid(region.corners, grid.lower, grid.edges)
    across = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(across, axis=1)
    table = element_table(elements).ravel()
    bricks = np.ravel_multi_index(tuple(elements.position.T), grid.shape)
    codes = [np.zeros(0, np.int64)]
    for axis in range(3):
        level = (triangles[:, :, axis] - grid.lower[axis]) / grid.edges[axis]
        flat = (np.abs(level - np.round(level[:, :1])) < ON_PLANE).all(axis=1) & (area > 0)
        face = float(np.prod(np.delete(grid.edges, axis)))
        for side in range(2):
            own = flat & (across[:, axis] > 0 if side else across[:, axis] < 0)
            if not own.any():
                continue
            middle = triangles[own].mean(axis=1).T
            middle[axis] -= (1e-3 if side else -1e-3) * grid.edges[axis]
            brick = brick_of(elements.grid, middle)
            first = np.where(brick >= 0, table[brick], -1)
            # The middle plane of a large element is none of its faces.
            depth = np.unravel_index(np.maximum(brick, 0), grid.shape)[axis]
            outer = elements.position[first, axis] + side * (elements.size[first] - 1)
            at = (first >= 0) & (depth == outer)
            sums = np.bincount(
                bricks[first[at]], weights=area[own][at], minlength=int(bricks.max()) + 1
            )
            reached = elements.faces[:, 2 * axis + side] != 0
            whole = COVERED * face * elements.size.astype(np.float64) ** 2
            covered = np.flatnonzero(reached & (sums[bricks] >= whole))
            codes.append(6 * covered + 2 * axis + side)
    return np.concatenate(codes)


def _face_codes(at: SurfacePoints) -> IntArray:
    """Face of its element that each point of a region lies on, coded likewise; -1 for none."""
    axis = np.argmax(np.abs(at.normal), axis=0)
    along = at.normal[axis, np.arange(axis.size)]
    return np.where(np.abs(along) > 1.0 - 1e-9, 6 * at.element + 2 * axis + (along > 0.0), -1)


def _face_nodes(space: BrickSpace, codes: IntArray) -> IntArray:
    """Nodes of faces of elements."""
    return np.unique(_nodes_by_face(space, codes))


def _nodes_by_face(space: BrickSpace, codes: IntArray) -> IntArray:
    """Nine nodes of each face of an element, ``(k, 9)``."""
    element, axis, side = codes // 6, codes % 6 // 2, codes % 2
    on_face = LOCAL[axis] == 2 * side[:, None]
    return np.asarray(space.nodes[element][on_face]).reshape(-1, 9)


def _held_alone(space: BrickSpace, codes: IntArray) -> IntArray:
    """Faces without hanging nodes that follow a node which no face holds."""
    if space.hanging is None:
        return codes
    free = space.hanging.values.shape[1]
    while len(codes):
        nodes = _nodes_by_face(space, codes)
        loose = np.ones(len(space.place), dtype=bool)
        loose[nodes] = False
        follows = abs(space.hanging.values) @ loose[:free].astype(np.float64) > 0.0
        loose[:] = False
        loose[free:] = follows
        bad = loose[nodes].any(axis=1)
        if not bad.any():
            break
        codes = codes[~bad]
    return codes


def _refuse_conflict(fixed: BoolArray, value: FloatArray, prescribed: float, region: str) -> None:
    """Raise if a node is already held at another displacement in this component."""
    clash = fixed & disagrees(value, prescribed)
    if clash.any():
        raise CaseError(
            f"region '{region}': its support prescribes {prescribed:g} mm where another one "
            f"prescribes {value[clash][0]:g} mm at {np.count_nonzero(clash)} common nodes; free "
            "that component in one of them or choose regions that do not touch"
        )


def _add_springs(
    elements: Elements,
    space: BrickSpace,
    fix: Support,
    at: SurfacePoints,
    weak: BoolArray,
    modulus: float,
    blocks: dict[int, FloatArray],
    force: FloatArray,
) -> float:
    """Add the springs of one support to the matrices of elements.

    Returns their energy, N mm, if their far ends alone moved as prescribed.
    """
    energy = 0.0
    if not weak.any():
        return energy
    stiffest = _SPRING * modulus / float(elements.grid.edges.max())
    held = [c for c, prescribed in enumerate(fix.displacement) if prescribed is not None]
    index = np.flatnonzero(weak)
    index = index[np.argsort(at.element[index], kind="stable")]
    for e, own in zip(*_groups(at.element[index], index), strict=True):
        stiff = stiffest / float(elements.size[e])
        shapes = shapes_at(at.reference[:, own])
        mass = stiff * np.einsum("qa,q,qb->ab", shapes, at.area[own], shapes)
        block = blocks.setdefault(int(e), np.zeros((27, 3, 27, 3)))
        sums = stiff * shapes.T @ at.area[own]
        for c in held:
            moved = float(fix.displacement[c] or 0.0)
            block[:, c, :, c] += mass
            np.add.at(force[:, c], space.nodes[e], moved * sums)
            energy += 0.5 * moved**2 * stiff * float(at.area[own].sum())
    return energy


def _groups(keys: IntArray, values: IntArray) -> tuple[IntArray, list[IntArray]]:
    """Values of equal, sorted keys together."""
    unique, first = np.unique(keys, return_index=True)
    return unique, np.split(values, first[1:])


def _collected(elements: Elements, blocks: Mapping[int, FloatArray]) -> Springs | None:
    """Springs of elements, by colour."""
    if not blocks:
        return None
    element, colours = sorted_by_colour(elements, np.array(sorted(blocks), dtype=np.int64))
    return Springs(
        element=element,
        colours=colours,
        blocks=np.stack([blocks[int(e)].reshape(81, 81) for e in element]),
    )


def _require_held(
    elements: Elements,
    space: BrickSpace,
    fixed: BoolArray,
    seen: list[tuple[FloatArray, tuple[bool, ...]]],
    name: str,
) -> None:
    """Raise unless strong and weak supports together hold the solid."""
    strong = fixed.any(axis=1)
    points = [node_points(elements, space)[:, strong]]
    held = [fixed[strong].T]
    for at, components in seen:
        points.append(at)
        held.append(np.broadcast_to(np.array(components)[:, None], at.shape))
    modes = free_modes(np.concatenate(points, axis=1), np.concatenate(held, axis=1))
    if modes:
        raise SolverError(
            f"load case '{name}': the supports leave rigid motions free: {'; '.join(modes)}. Fix "
            "more faces or components"
        )
