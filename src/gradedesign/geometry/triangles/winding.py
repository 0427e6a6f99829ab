"""Winding numbers of a closed surface about points of space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.triangles import _winding_kernels as kernels

#: Rays along each of the three axes, unless said otherwise.
RAYS = 128 * 128
#: Where in its cell of the grid a ray passes, and a turn of half a radian of the grid about the
#: rays: off the round numbers and the directions at which parts have edges.
_OFFSET = (0.5 + 1.0 / np.pi**3, 0.5 - 1.0 / np.e**3)
_TURN = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])


def winding_numbers(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Solid angle of a closed shell seen from each point, over 4 pi.

    Van Oosterom and Strackee (1983), "The solid angle of a plane triangle", eq. 8.

    Parameters
    ----------
    corners : (m, 3, 3) array, mm
    points : (k, 3) array, mm

    Returns
    -------
    (k,) array
        1 inside an outward shell, -1 inside a reversed one, 0 outside.
    """
    result = np.zeros(len(points))
    kernels.solid_angles(np.ascontiguousarray(corners), np.ascontiguousarray(points), result)
    return result


class WindingVolumes(NamedTuple):
    """Answer of :func:`winding_volumes`.

    Attributes
    ----------
    solid : float, mm^3
        Volume with a winding number of at least 1.
    excess : float, mm^3
        Integral of the winding number beyond 1: what the enclosed volume counts too often.
    reversed : float, mm^3
        Integral of the magnitude of negative winding numbers: what it takes off.
    torn : float
        Share of the rays that met the surface unequally often from its two sides.
    """

    solid: float
    excess: float
    reversed: float
    torn: float


def winding_volumes(corners: FloatArray, rays: int = RAYS) -> WindingVolumes:
    """Volumes by winding number, from rays along the three axes.

    The enclosed volume of a closed surface is ``solid + excess - reversed``; a surface that
    neither overlaps itself nor turns inside out has neither excess nor reversed volume.

    Parameters
    ----------
    corners : (m, 3 corners, 3 coordinates) array, mm
        Of a closed, consistently oriented surface.
    rays : int
        Along each axis, about.
    """
    enclosed = np.zeros((3, 3))
    torn = 0.0
    for axis in range(3):
        turned = np.roll(corners, 2 - axis, axis=2)
        turned = turned - turned.min(axis=(0, 1))
        turned[:, :, :2] @= _TURN
        low = turned.min(axis=(0, 1))
        turned -= low
        extent = turned.max(axis=(0, 1))[:2]
        share = np.sqrt(rays / np.prod(extent)) if extent.all() else 1.0
        shape = np.clip(np.ceil(extent * share), 16, max(16, rays // 16)).astype(np.int64)
        step = np.maximum(extent, 1e-300) / shape
        *lengths, lost = kernels.ray_lengths(turned, step * _OFFSET, step, shape)
        enclosed[axis] = np.array(lengths) * np.prod(step)
        torn += lost / np.prod(shape) / 3.0
    solid, excess, backward = enclosed.mean(axis=0)
    return WindingVolumes(float(solid), float(excess), float(backward), float(torn))
