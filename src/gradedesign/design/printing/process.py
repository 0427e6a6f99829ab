"""A printing process: how it changes the surface, the scatter and the stiffness of what it builds.

Publications state how much thicker or thinner struts become by the inclination of their axes; the
surface of anything else needs an offset by the inclination of its normal. The two are one relation.
A strut whose axis is inclined to the plate by ``theta`` has normals whose vertical component is
``cos(theta) sin(phi)``, phi around it, so that its mean width grows by ``D(c) = (4 / pi) *
integral of d(c sin(phi))`` over a right angle, with ``c = cos(theta)`` and the offset d of the
surface by the vertical component of its normal. That is Schloemilch's integral equation, whose one
continuous solution is ``d(s) = (D(0) + s * integral of D'(s sin(phi))) / 2``: a process whose table
is of struts has this offset on every surface, and struts of every inclination then grow as it says.
Struts tell up from down as little as the solution does; a table of offsets may.

References
----------
O. Schloemilch (1857), Zeitschrift fuer Mathematik und Physik 2, 155. E. T. Whittaker, G. N. Watson
(1927), A Course of Modern Analysis, section 11.81.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.material import Material

#: Pairs of an inclination in degrees and a length in mm, by rising inclination.
ByInclination = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Waviness:
    """Random deviation of the surface from place to place.

    Attributes
    ----------
    amplitude : float, mm
        Root mean square.
    length : float, mm
        Distance over which it is alike: its correlation falls as ``exp(-(r / length)^2 / 2)``.
    """

    amplitude: float
    length: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Process:
    """How a machine prints a material, as measured.

    Attributes
    ----------
    strut_size : pairs of degrees and mm
        Change of the mean width of struts by the inclination of their axis to the plate: 0 lies, 90
        stands. Linear in the cosine between the pairs, constant beyond them. Empty where the source
        gives none.
    offset : pairs of degrees and mm
        Growth of the surface by its inclination, instead: 0 looks down at the plate, 90 is a wall,
        180 looks up. Linear between the pairs, constant beyond them.
    scatter : float or None, mm
        Standard deviation of the size from strut to strut.
    waviness : Waviness or None
    least_feature : float or None, mm
        Thinnest wall or strut that prints.
    stiffness : float or None
        Young's modulus of the printed solid over that of the material; across the build direction
        where another one is known along it.
    stiffness_along : float or None
        The same along the build direction; None: in all directions alike.
    shear_along : float or None
        Shear modulus in planes along the build direction over that in planes across it; None: by
        Saint-Venant's relation.
    material, machine : str
        That were measured.
    samples : int or None
        Measured struts or specimens of every entry.
    sizes : (float, float) or None, mm
        Sizes of the struts that were measured: the window of the record.
    source : str
        Where the figures come from, and how they were taken.
    """

    name: str
    strut_size: ByInclination = ()
    offset: ByInclination = ()
    scatter: float | None = None
    waviness: Waviness | None = None
    least_feature: float | None = None
    stiffness: float | None = None
    stiffness_along: float | None = None
    shear_along: float | None = None
    material: str = ""
    machine: str = ""
    samples: int | None = None
    sizes: tuple[float, float] | None = None
    source: str = "stated in the case"

    @property
    def has_body(self) -> bool:
        """Whether anything is known by which what it builds differs from what is designed."""
        known = self.strut_size or self.offset or self.waviness or self.stiffness
        return known is not None and known != ()

    def strut_size_at(self, inclination: float) -> float:
        """Change of the mean width of a strut, mm, by the inclination of its axis in degrees."""
        if self.strut_size:
            cosine, size = _by_cosine(self.strut_size)
            return float(np.interp(np.cos(np.radians(inclination)), cosine, size))
        around = (np.arange(720) + 0.5) * (2.0 * np.pi / 720)
        vertical = np.cos(np.radians(inclination)) * np.sin(around)
        return float(2.0 * surface_offset(self, vertical).mean())

    def printed(self, material: Material, up: FloatArray) -> Material:
        """A material as the process prints it; ``up``, (3,): the axis it is built along."""
        if self.stiffness is None:
            return material
        axis = int(np.abs(up).argmax())
        return material.built(axis, self.stiffness, self.stiffness_along, self.shear_along)


def surface_offset(process: Process, vertical: FloatArray) -> FloatArray:
    """Offset of the surface by a process, mm; positive where it grows.

    ``vertical``, (m,) array: component of the outward normals along the build direction, -1 to 1.
    """
    if process.offset:
        angles, lengths = np.array(process.offset, dtype=np.float64).T
        inclination = np.degrees(np.arccos(np.clip(-vertical, -1.0, 1.0)))
        return np.asarray(np.interp(inclination, angles, lengths))
    if not process.strut_size:
        return np.zeros_like(vertical)
    cosine, size = _by_cosine(process.strut_size)
    s = np.clip(np.abs(vertical), 1e-12, 1.0)
    turned = np.arcsin(np.minimum(1.0, cosine[:, None] / s))
    slopes = np.diff(size) / np.diff(cosine)
    # The integral of a derivative that is constant between the pairs.
    integral = (slopes[:, None] * np.diff(turned, axis=0)).sum(axis=0)
    return np.asarray(0.5 * (size[0] + s * integral))


def _by_cosine(strut_size: ByInclination) -> tuple[FloatArray, FloatArray]:
    """Cosines of the inclinations, rising, and the sizes at them."""
    angles, lengths = np.array(strut_size, dtype=np.float64)[::-1].T
    return np.cos(np.radians(angles)), lengths
