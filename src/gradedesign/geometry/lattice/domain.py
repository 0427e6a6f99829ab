"""The design domain: the part, divided into skin, passive solid and lattice."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, locked
from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.drain import Drain
from gradedesign.geometry.lattice.net_skin import NetSkin
from gradedesign.geometry.lattice.skin import Skin, skin_value, thicker

#: Phases of the printed solid: indices into ``verify.measures.PHASES``.
LATTICE, SKIN, KEPT = 0, 1, 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PassiveRegion:
    """A region of the part that stays solid.

    Attributes
    ----------
    distance : callable
        Unsigned distance to a region's surface, or that to a volume, negative inside: points
        ``(3, ...)`` mm to ``(...)`` mm.
    margin : float, mm
        The part is solid within this distance.
    thickness : float, mm, optional
        Of what is solid in the part; the margin without it.
    from_surface : float, mm, optional
        Of a volume, how far the part's faces were moved outward: what lies beyond them before it
        belongs to it, so that it ends at the part's faces where it is flush with them.
    """

    distance: Field
    margin: float
    thickness: float | None = None
    from_surface: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Filling:
    """A place below the skins that is solid because of its shape, such as a small cavity.

    Attributes
    ----------
    distance : callable
        Points ``(3, ...)`` mm to ``(...)`` mm, negative inside, of slope one at most.
    note : str
        Remark for the user.
    """

    distance: Field
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignDomain:
    """The part that is designed.

    Attributes
    ----------
    distance : callable
        Signed distance of the part, points ``(3, ...)`` mm to ``(...)`` mm, negative inside.
    lower, upper : (3,) array, mm
        Box around the part.
    skins : tuple of Skin
        Solid layers below its faces.
    nets : tuple of NetSkin
        Struts laid onto its faces; they count as lattice.
    passive : tuple of PassiveRegion
        Regions that stay solid.
    fillings : tuple of Filling
        Further solid places; they count as skin.
    drains : tuple of Drain
        Holes that cut lattice, skins and passive regions.
    joint_radius : float, mm
        Of the fillets where lattice, skins and passive regions meet; 0: none.
    bodies : int
        Connected components of the part.
    least_rim : float, mm
        Rims of less solid below the part's faces, at flat angles, are left out; 0: none.
    overhang : float, mm
        By which the faces of ``distance`` lie outside those of the part, see `grown`.

    Raises
    ------
    LatticeError
        If the box is empty, a margin is not positive, or the radius of joints is negative.
    """

    distance: Field
    lower: FloatArray
    upper: FloatArray
    skins: tuple[Skin, ...] = ()
    nets: tuple[NetSkin, ...] = ()
    passive: tuple[PassiveRegion, ...] = ()
    fillings: tuple[Filling, ...] = ()
    drains: tuple[Drain, ...] = ()
    joint_radius: float = 0.0
    bodies: int = 1
    least_rim: float = 0.0
    overhang: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "upper", locked(self.upper, (3,), name="upper"))
        if not (self.upper > self.lower).all():
            raise LatticeError(f"the lattice's box is empty: {self.lower} to {self.upper} mm")
        margins = [p.margin for p in self.passive]
        if any(not s > 0 for s in margins) or not self.joint_radius >= 0:
            raise LatticeError(
                f"margins of passive regions must be positive and the radius of joints not "
                f"negative, got {margins} mm and {self.joint_radius:g} mm; leave out what is not "
                f"wanted"
            )

    @property
    def lattice_only(self) -> bool:
        """Whether no place of the part is solid."""
        return not self.skins and not self.passive

    @property
    def layers(self) -> tuple[float, ...]:
        """Least thicknesses of its skins, nets and passive regions, mm, in their order."""
        passive = [p.margin if p.thickness is None else p.thickness for p in self.passive]
        return (*(s.least for s in self.skins), *(n.thickness for n in self.nets), *passive)


def passive_at(domain: DesignDomain, points: FloatArray) -> BoolArray:
    """Whether points ``(3, ...)`` mm lie in a passive region, ``(...)``."""
    inside = np.zeros(np.shape(points)[1:], dtype=bool)
    for region in domain.passive:
        inside |= region.distance(points) < region.margin
    return inside


def phase_at(
    domain: DesignDomain, points: FloatArray, distance: FloatArray | None = None
) -> IntArray:
    """Phase of points of the part ``(3, ...)`` mm, ``(...)``: `LATTICE`, `SKIN` or `KEPT`.

    ``distance`` is that of the part where it is known already.
    """
    phase = np.full(np.shape(points)[1:], LATTICE, dtype=np.int64)
    if domain.skins:
        to_part = domain.distance(points) if distance is None else distance
        for skin in domain.skins:
            phase[skin_value(skin, points, to_part) < 0] = SKIN
    for filling in domain.fillings:
        open_ones = phase == LATTICE
        filled = filling.distance(np.asarray(points)[:, open_ones]) < 0
        phase[open_ones] = np.where(filled, SKIN, LATTICE)
    if domain.passive:
        phase[passive_at(domain, points)] = KEPT
    return phase


def grown(domain: DesignDomain, overhang: float) -> DesignDomain:
    """The domain with its faces moved outward by ``overhang``, mm; inside, nothing moves."""
    inner = domain.distance
    return replace(
        domain,
        distance=lambda points: inner(points) - overhang,
        overhang=domain.overhang + overhang,
        skins=tuple(thicker(skin, overhang) for skin in domain.skins),
        nets=tuple(
            replace(
                net,
                thickness=net.thickness + overhang,
                reach=net.reach + overhang,
                start=net.start + overhang,
            )
            for net in domain.nets
        ),
        passive=tuple(
            p if p.from_surface is None else replace(p, from_surface=p.from_surface + overhang)
            for p in domain.passive
        ),
        lower=domain.lower - overhang,
        upper=domain.upper + overhang,
    )
