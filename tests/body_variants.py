"""Files of bodies that touch, lie in each other, or close on themselves, by script.

Volumes and areas follow by hand from the sizes that stand here, never from a program's mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import manifold3d
import numpy as np
from damaged_shapes import box, corners_of, rod, swept
from scipy.spatial.transform import Rotation

#: Edges of the block of most files, mm.
BLOCK = (60.0, 40.0, 20.0)
#: Corners of a bore of radius 8 and of the bushing's hole of radius 5, and its length, mm.
SIDES, OUTER, INNER, LENGTH = 48, 8.0, 5.0, 20.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Corners of the bodies of a file, and how it must be read.

    Attributes
    ----------
    shells : tuple of (m, 3, 3) arrays, mm
    solids : int
        That it holds.
    joined : int
        Solids after those with common faces are united.
    volume : float, mm^3
    area : float, mm^2
        Of the surface once united.
    common : float, mm^2
        Of the faces in which solids touch.
    itself : bool
        Whether a body touches itself, elsewhere than along doubled facets.
    """

    shells: tuple[np.ndarray, ...]
    solids: int
    joined: int
    volume: float
    area: float
    common: float
    itself: bool = False


def polygon(radius: float, sides: int = SIDES) -> float:
    """Area of a regular polygon, mm^2."""
    return 0.5 * sides * radius**2 * np.sin(2 * np.pi / sides)


def around(radius: float, sides: int = SIDES) -> float:
    """Length around a regular polygon, mm."""
    return 2.0 * sides * radius * np.sin(np.pi / sides)


def faces_of(a: float, b: float, c: float) -> float:
    """Surface of a box, mm^2."""
    return 2.0 * (a * b + b * c + c * a)


def solid(low, high) -> manifold3d.Manifold:
    size = [float(b - a) for a, b in zip(low, high, strict=True)]
    return manifold3d.Manifold.cube(size).translate([float(v) for v in low])


def halves() -> Bodies:
    """Two boxes with a whole face in common."""
    shells = box((0, 0, 0), (30, 40, 20)), box((30, 0, 0), BLOCK)
    return Bodies(shells=shells, solids=2, joined=1, volume=48e3, area=faces_of(*BLOCK), common=800)


def peg() -> Bodies:
    """A box on the middle of a larger face: 20 x 10 of it are covered."""
    shells = box((0, 0, 0), (30, 40, 20)), box((30, 10, 5), (60, 30, 15))
    area = faces_of(30, 40, 20) + faces_of(30, 20, 10) - 2 * 200
    return Bodies(shells=shells, solids=2, joined=1, volume=30e3, area=area, common=200)


def bricks() -> Bodies:
    """Two boxes of which neither covers the other's face: 20 x 15 in common."""
    shells = box((0, 0, 0), (30, 30, 20)), box((30, 10, 5), (60, 40, 25))
    area = 2 * faces_of(30, 30, 20) - 2 * 300
    return Bodies(shells=shells, solids=2, joined=1, volume=36e3, area=area, common=300)


def at_an_edge() -> Bodies:
    """Two boxes with an edge in common, and no face."""
    shells = box((0, 0, 0), (30, 20, 20)), box((30, 20, 0), BLOCK)
    area = 2 * faces_of(30, 20, 20)
    return Bodies(shells=shells, solids=2, joined=2, volume=24e3, area=area, common=0)


def at_a_corner() -> Bodies:
    """Two boxes with a corner in common."""
    shells = box((0, 0, 0), (30, 20, 10)), box((30, 20, 10), BLOCK)
    area = 2 * faces_of(30, 20, 10)
    return Bodies(shells=shells, solids=2, joined=2, volume=12e3, area=area, common=0)


def in_a_row() -> Bodies:
    """Three boxes side by side, 800 mm^2 between each two."""
    shells = tuple(box((20 * k, 0, 0), (20 * k + 20, 40, 20)) for k in range(3))
    area = faces_of(*BLOCK)
    return Bodies(shells=shells, solids=3, joined=1, volume=48e3, area=area, common=1600)


def around_an_edge() -> Bodies:
    """Three boxes around one edge of 20 mm; two faces of 30 x 20 and one of 20 x 20 are shared."""
    shells = (
        box((0, 0, 0), (30, 20, 20)),
        box((30, 0, 0), (60, 20, 20)),
        box((0, 20, 0), (30, 40, 20)),
    )
    area = 2 * (2400 - 600) + 20 * (60 + 20 + 30 + 20 + 30 + 40)
    return Bodies(shells=shells, solids=3, joined=1, volume=36e3, area=area, common=400 + 600)


def inlay() -> Bodies:
    """A box in a pocket of a block, flush with its top: floor and four walls touch."""
    pocket = solid((20, 15, 10), (40, 25, 20))
    shells = corners_of(solid((0, 0, 0), BLOCK) - pocket), corners_of(pocket)
    common = 200 + 2 * (20 + 10) * 10
    return Bodies(
        shells=shells, solids=2, joined=1, volume=48e3, area=faces_of(*BLOCK), common=common
    )


def proud_inlay() -> Bodies:
    """The box in the pocket stands out by 5 mm."""
    pocket = solid((20, 15, 10), (40, 25, 20))
    shells = corners_of(solid((0, 0, 0), BLOCK) - pocket), box((20, 15, 10), (40, 25, 25))
    area = faces_of(*BLOCK) + 2 * (20 + 10) * 5
    common = 200 + 2 * (20 + 10) * 10
    return Bodies(shells=shells, solids=2, joined=1, volume=49e3, area=area, common=common)


def angle_inlay() -> Bodies:
    """An L of 20 mm thickness set into the corner of a block, all through it."""
    corner = solid((0, 0, 0), (40, 10, 20)) + solid((0, 0, 0), (10, 40, 20))
    shells = corners_of(solid((0, 0, 0), BLOCK) - corner), corners_of(corner)
    common = 20 * (10 + 30 + 30)
    return Bodies(
        shells=shells, solids=2, joined=1, volume=48e3, area=faces_of(*BLOCK), common=common
    )


def filled_void() -> Bodies:
    """A void of 20 x 10 x 10 that a second body fills."""
    shells = (
        box((0, 0, 0), BLOCK),
        box((20, 15, 5), (40, 25, 15), reverse=True),
        box((20, 15, 5), (40, 25, 15)),
    )
    common = faces_of(20, 10, 10)
    return Bodies(
        shells=shells, solids=2, joined=1, volume=48e3, area=faces_of(*BLOCK), common=common
    )


def half_filled_void() -> Bodies:
    """A body fills half of a void: five of its faces touch."""
    shells = (
        box((0, 0, 0), BLOCK),
        box((20, 15, 5), (40, 25, 15), reverse=True),
        box((20, 15, 5), (30, 25, 15)),
    )
    return Bodies(
        shells=shells,
        solids=2,
        joined=1,
        volume=47e3,
        area=faces_of(*BLOCK) + faces_of(10, 10, 10),
        common=500,
    )


def loose_core() -> Bodies:
    """A core in a void that it does not touch."""
    shells = (
        box((0, 0, 0), BLOCK),
        box((20, 12, 5), (40, 28, 15), reverse=True),
        box((25, 16, 7), (35, 24, 13)),
    )
    area = faces_of(*BLOCK) + faces_of(20, 16, 10) + faces_of(10, 8, 6)
    return Bodies(shells=shells, solids=2, joined=2, volume=48e3 - 3200 + 480, area=area, common=0)


def void() -> Bodies:
    """One body with a void."""
    shells = box((0, 0, 0), BLOCK), box((20, 15, 5), (40, 25, 15), reverse=True)
    area = faces_of(*BLOCK) + faces_of(20, 10, 10)
    return Bodies(shells=shells, solids=1, joined=1, volume=46e3, area=area, common=0)


def inner_shell() -> Bodies:
    """A shell inside a solid that runs the same way round bounds nothing."""
    shells = box((0, 0, 0), BLOCK), box((20, 15, 5), (40, 25, 15))
    return Bodies(shells=shells, solids=1, joined=1, volume=48e3, area=faces_of(*BLOCK), common=0)


def flush_overlap() -> Bodies:
    """An inlay, flush with the top of a block that has no pocket for it."""
    shells = box((0, 0, 0), BLOCK), box((20, 15, 10), (40, 25, 20))
    return Bodies(shells=shells, solids=1, joined=1, volume=48e3, area=faces_of(*BLOCK), common=0)


def end_overlap() -> Bodies:
    """Two boxes of one end face, of which one is the longer."""
    shells = box((0, 0, 0), BLOCK), box((0, 0, 0), (25, 40, 20))
    return Bodies(shells=shells, solids=1, joined=1, volume=48e3, area=faces_of(*BLOCK), common=0)


def bushing() -> Bodies:
    """A bushing in a bore all through a block, both of 48 sides."""
    outer, inner = rod(LENGTH, OUTER, SIDES), rod(2 * LENGTH, INNER, SIDES).translate((0, 0, -5))
    place = (30, 20, 0)
    shells = (
        corners_of(solid((0, 0, 0), BLOCK) - outer.translate(place)),
        corners_of((outer - inner).translate(place)),
    )
    return Bodies(
        shells=shells,
        solids=2,
        joined=1,
        volume=48e3 - LENGTH * polygon(INNER),
        area=faces_of(*BLOCK) - 2 * polygon(INNER) + LENGTH * around(INNER),
        common=LENGTH * around(OUTER),
    )


def boss() -> Bodies:
    """A round boss, of 0.07 % of the volume, on a plate: no fragment."""
    radius, height = 2.0, 3.0
    shells = box((0, 0, 0), BLOCK), corners_of(rod(height, radius, SIDES).translate((25, 15, 20)))
    return Bodies(
        shells=shells,
        solids=2,
        joined=1,
        volume=48e3 + height * polygon(radius),
        area=faces_of(*BLOCK) + height * around(radius),
        common=polygon(radius),
    )


def wedges() -> Bodies:
    """A block cut along the diagonal of its top."""
    outline = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 40.0]])
    lower = swept(np.array([np.column_stack([outline, np.full(3, z)]) for z in (0.0, 20.0)]))
    upper = np.array([60.0, 40.0, 0.0]) + lower * [-1.0, -1.0, 1.0]
    common = 20.0 * np.hypot(60.0, 40.0)
    return Bodies(
        shells=(lower, upper),
        solids=2,
        joined=1,
        volume=48e3,
        area=faces_of(*BLOCK),
        common=common,
    )


def arch() -> Bodies:
    """One body: an arch on a plate, of which one foot grows out of it and the other touches it."""
    foot = solid((40, 10, 22), (50, 20, 40))  # 2 mm above the plate, moved down below
    beam, leg = solid((10, 10, 30), (50, 20, 40)), solid((10, 10, 15), (20, 20, 40))
    corners = corners_of(solid((0, 0, 0), BLOCK) + leg + beam + foot)
    corners[corners[:, :, 2] == 22.0, 2] = 20.0
    legs, top = 2 * 4 * 10 * 10, faces_of(40, 10, 10) - 2 * 100
    return Bodies(
        shells=(corners,),
        solids=1,
        joined=1,
        volume=48e3 + 2 * 1000 + 4000,
        area=faces_of(*BLOCK) - 2 * 100 + legs + top,
        common=0.0,
        itself=True,
    )


def ring() -> Bodies:
    """One body: a bar of 6 x 10 mm swept around once, so that its end faces coincide."""
    return _swept_ring(1)


def half_rings() -> Bodies:
    """Two halves of the ring, which touch in two faces."""
    return _swept_ring(2)


def _swept_ring(pieces: int) -> Bodies:
    square = np.array([[15.0, 0.0], [15.0, 10.0], [21.0, 10.0], [21.0, 0.0]])
    turns = np.split(np.arange(SIDES), pieces)
    shells = []
    for turn in turns:
        phi = 2 * np.pi / SIDES * np.append(turn, (turn[-1] + 1) % SIDES)
        bar = np.stack(
            [
                np.outer(np.cos(phi), square[:, 0]),
                np.outer(np.sin(phi), square[:, 0]),
                np.tile(square[:, 1], (len(phi), 1)),
            ],
            axis=2,
        )
        shells.append(swept(bar))
    return Bodies(
        shells=tuple(shells),
        solids=pieces,
        joined=1,
        volume=10.0 * (polygon(21.0) - polygon(15.0)),
        area=2 * (polygon(21.0) - polygon(15.0)) + 10.0 * (around(21.0) + around(15.0)),
        common=60.0 * pieces if pieces > 1 else 0.0,
    )


KINDS = (
    halves, peg, bricks, at_an_edge, at_a_corner, in_a_row, around_an_edge, inlay, proud_inlay,
    angle_inlay, filled_void, half_filled_void, loose_core, void, inner_shell, flush_overlap,
    end_overlap, bushing, boss, wedges, arch, ring, half_rings,
)  # fmt: skip


def mirrored(corners: np.ndarray) -> np.ndarray:
    """The same flat faces, their quadrangles cut along the other diagonal where they can be.

    Two facets in one plane with an edge in common, of which the four corners are convex, are
    cut along the other one.
    """
    facets = [list(map(tuple, facet)) for facet in corners.tolist()]
    done: set[int] = set()
    sides = {(f[k], f[(k + 1) % 3]): n for n, f in enumerate(facets) for k in range(3)}
    for n in range(len(facets)):
        for k in range(3):
            a, b, c = (facets[n][(k + m) % 3] for m in range(3))
            other = sides.get((b, a))
            if n in done or other is None or other in done:
                continue
            d = next(p for p in facets[other] if p not in (a, b))
            one, two = _normal(a, d, c), _normal(d, b, c)
            flat = np.linalg.norm(np.cross(_normal(a, b, c), _normal(b, a, d))) < 1e-9
            if flat and one @ _normal(a, b, c) > 1e-3 and two @ _normal(a, b, c) > 1e-3:
                facets[n], facets[other] = [a, d, c], [d, b, c]
                done |= {n, other}
    return np.array(facets)


def _normal(a, b, c) -> np.ndarray:
    return np.cross(np.subtract(b, a), np.subtract(c, a))


def refined(corners: np.ndarray) -> np.ndarray:
    """Every facet cut into nine."""
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3).astype(np.uint64)
    mesh = manifold3d.Mesh64(vert_properties=points, tri_verts=faces)
    return corners_of(manifold3d.Manifold(mesh).refine(3))


TRIANGLES = {"same": np.array, "diagonals": mirrored, "finer": refined}


def variants(seed: int) -> Iterator[tuple[str, Bodies, np.ndarray]]:
    """Every kind by every triangulation of its last body, in place and moved.

    Yields its name, the bodies, and the corners of the file, in single precision once it is
    written. Facets are shuffled in some, and some are inside out as a whole.
    """
    rng = np.random.default_rng(seed)
    for kind in KINDS:
        for name, cut in TRIANGLES.items():
            if kind is ring and name == "finer":
                continue  # cut by the kernel, which joins the ring
            bodies = kind()
            shells = [*bodies.shells[:-1], cut(bodies.shells[-1])]
            for moved in (False, True):
                corners = np.concatenate(shells)
                if moved:
                    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
                    corners = corners @ turn.T + rng.uniform(-80.0, 80.0, 3)
                if rng.random() < 0.4:
                    corners = rng.permutation(corners)
                if rng.random() < 0.2:
                    corners = corners[:, ::-1]
                yield (
                    f"{kind.__name__}, {name}, {'moved' if moved else 'in place'}",
                    bodies,
                    corners,
                )
