"""Solids of coupons: struts on a base, and numbers that are engraved in flat faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradedesign import SurfaceMesh
from gradedesign_laboratory.coupons import Struts

#: Bars of a digit on a grid of 3 x 5 squares, as columns and rows from the lower left, both ends
#: included: those of a seven-segment display.
_BARS = {
    "top": (0, 4, 2, 4), "middle": (0, 2, 2, 2), "bottom": (0, 0, 2, 0),
    "upper_left": (0, 2, 0, 4), "upper_right": (2, 2, 2, 4),
    "lower_left": (0, 0, 0, 2), "lower_right": (2, 0, 2, 2),
}  # fmt: skip
_DIGITS = {
    "0": "top bottom upper_left upper_right lower_left lower_right",
    "1": "upper_right lower_right",
    "2": "top upper_right middle lower_left bottom",
    "3": "top upper_right middle lower_right bottom",
    "4": "upper_left middle upper_right lower_right",
    "5": "top upper_left middle lower_right bottom",
    "6": "top upper_left middle lower_left lower_right bottom",
    "7": "top upper_right lower_right",
    "8": "top middle bottom upper_left upper_right lower_left lower_right",
    "9": "top upper_left upper_right middle lower_right bottom",
}
#: Edge of a square of that grid, and depth of the engraving, mm: grooves twice as wide as common
#: powder-bed processes resolve, half as deep as wide. Chosen, not measured.
STROKE, DEPTH = 0.9, 0.5
#: Width and height of a number with its underline, mm.
NUMBER_SIZE = (7.0 * STROKE, 7.0 * STROKE)
#: How far an engraving reaches beyond the face, mm.
_ABOVE = 1.0

#: Inclination, degrees, below which struts span between two posts: flatter ones would sag.
_SPANNING = 20.0
#: Length of struts that stand free, and between posts, over their width, and least, mm. Chosen, not
#: measured.
_FREE, _LEAST_FREE, _SPAN, _LEAST_SPAN = 6.0, 5.0, 4.0, 3.0
#: Room between neighbouring struts for a gauge, mm.
_BETWEEN = 2.5
#: Base, posts and edges around the number, mm. Chosen, not measured.
_BASE, _POST, _MARGIN, _ROOT = 2.0, 1.5, 1.0, 0.2
#: Facets of a strut: it is as thick as a circle of its area within 0.03 %.
_FACETS = 96


def _surface(solid: Any) -> SurfaceMesh:
    """The closed surface of a solid of the Boolean kernel."""
    mesh = solid.to_mesh64()
    return SurfaceMesh(
        vertices=np.asarray(mesh.vert_properties)[:, :3],
        faces=np.asarray(mesh.tri_verts).astype(np.int64),
    )


def _box(lower: tuple[float, float, float], upper: tuple[float, float, float]) -> Any:
    from manifold3d import Manifold

    size = [high - low for low, high in zip(lower, upper, strict=True)]
    return Manifold.cube(size).translate(list(lower))


def _engraving(number: int, middle: tuple[float, float], top: float) -> Any:
    """The solid that a number takes out of a face at height ``top``, mm.

    Two digits and an underline, by which 6 and 9 are told apart.
    """
    from manifold3d import Manifold

    x = middle[0] - NUMBER_SIZE[0] / 2.0
    y = middle[1] - NUMBER_SIZE[1] / 2.0
    squares = [(0, 0, 6, 0)]
    for place, digit in enumerate(f"{number:02d}"):
        for bar in _DIGITS[digit].split():
            a, b, c, d = _BARS[bar]
            squares.append((a + 4 * place, b + 2, c + 4 * place, d + 2))
    bars = [
        _box(
            (x + STROKE * a, y + STROKE * b, top - DEPTH),
            (x + STROKE * (c + 1), y + STROKE * (d + 1), top + _ABOVE),
        )
        for a, b, c, d in squares
    ]
    united = Manifold()
    for bar in bars:
        united += bar
    return united


def engraving(number: int, middle: tuple[float, float], top: float) -> SurfaceMesh:
    """Closed surface of what a number takes out of a flat face.

    Parameters
    ----------
    middle : (float, float), mm
        Of the number, along x and y.
    top : float, mm
        Height of the face.
    """
    return _surface(_engraving(number, middle, top))


def strut_coupon(struts: Struts) -> SurfaceMesh:
    """Closed surface of struts on their base, whose number is engraved; least corner at 0, mm."""
    radius, inclination = struts.width / 2.0, struts.inclination
    base = max(_BASE, 1.5 * struts.width + 0.5)
    pitch = struts.width + _BETWEEN
    depth = max(struts.count * pitch, NUMBER_SIZE[1] + 2.0 * _MARGIN)
    pad = NUMBER_SIZE[0] + 2.0 * _MARGIN
    make = _spanning if inclination < _SPANNING else _standing
    base_end, solids = make(struts, pad, base)
    first = 0.5 * (depth - struts.count * pitch) + 0.5 * pitch
    solid = _box((0.0, 0.0, 0.0), (base_end, depth, base))
    for low, high in solids["posts"]:
        solid += _box((low, 0.0, 0.0), (low + max(_POST, 2.0 * radius), depth, high))
    for n in range(struts.count):
        solid += solids["rod"].translate([0.0, first + n * pitch, 0.0])
    solid -= _engraving(struts.number, (pad / 2.0, depth / 2.0), base)
    return _surface(solid)


def _rod(struts: Struts, start: tuple[float, float], length: float) -> Any:
    """A strut from a point of the plane y = 0, ``(x, z)`` in mm."""
    from manifold3d import Manifold

    turn = 2.0 * np.pi / _FACETS
    radius = struts.width / 2.0 * float(np.sqrt(turn / np.sin(turn)))
    rod = Manifold.cylinder(length, radius, radius, _FACETS)
    return rod.rotate([0.0, 90.0 - struts.inclination, 0.0]).translate([start[0], 0.0, start[1]])


def _standing(struts: Struts, pad: float, base: float) -> tuple[float, dict[str, Any]]:
    """Struts that stand free on the base: end of the base, mm, and their solid."""
    angle, radius = np.radians(struts.inclination), struts.width / 2.0
    sine, cosine = float(np.sin(angle)), float(np.cos(angle))
    low = _ROOT + radius * cosine
    rooted = (base + radius * cosine - low) / sine
    start = pad + _MARGIN + radius * sine
    end = start + rooted * cosine + radius / sine + _MARGIN
    free = max(_FREE * struts.width, _LEAST_FREE)
    return end, {"posts": (), "rod": _rod(struts, (start, low), rooted + free)}


def _spanning(struts: Struts, pad: float, base: float) -> tuple[float, dict[str, Any]]:
    """Struts between two posts: end of the base, mm, the posts and their solid."""
    slope = float(np.tan(np.radians(struts.inclination)))
    post, radius = max(_POST, struts.width), struts.width / 2.0
    span = max(_SPAN * struts.width, _LEAST_SPAN)
    near, far = pad, pad + post + span
    height = base + _FREE / 3.0 + radius
    middle = near + 0.5 * post
    reach = far + 0.5 * post - middle
    posts = [(near, height + post * slope + radius + _MARGIN)]
    posts.append((far, height + (reach + post) * slope + radius + _MARGIN))
    length = float(np.hypot(reach, reach * slope))
    return far + post, {"posts": posts, "rod": _rod(struts, (middle, height), length)}
