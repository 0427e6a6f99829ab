"""The design domain: the part, and which of it is skin, passive solid or lattice."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray, locked
from gradedesign.errors import LatticeError
from gradedesign.mesh.tet_mesh import TetMesh

#: Phases of the printed solid: indices into ``verify.measures.PHASES``.
LATTICE, SKIN, KEPT = 0, 1, 2
#: Sample points per edge when the solid fraction of a tetrahedron is counted.
FRACTION_SAMPLES = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PassiveRegion:
    """A region of the part that stays solid.

    Attributes
    ----------
    distance : callable
        Unsigned distance to the region's surface, points ``(3, ...)`` mm to ``(...)`` mm.
    margin : float, mm
        The part is solid within this distance.
    """

    distance: Field
    margin: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignDomain:
    """The part that is designed.

    Attributes
    ----------
    distance : callable
        Signed distance of the part, points ``(3, ...)`` mm to ``(...)`` mm, negative inside.
    lower, upper : (3,) array, mm
        Box around the part.
    skin : float, optional, mm
        Thickness of the solid skin.
    passive : tuple of PassiveRegion
        Regions that stay solid.
    bodies : int
        Connected components of the part.

    Raises
    ------
    LatticeError
        If the box is empty, or a skin or margin is not positive.
    """

    distance: Field
    lower: FloatArray
    upper: FloatArray
    skin: float | None = None
    passive: tuple[PassiveRegion, ...] = ()
    bodies: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "upper", locked(self.upper, (3,), name="upper"))
        if not (self.upper > self.lower).all():
            raise LatticeError(f"the lattice's box is empty: {self.lower} to {self.upper} mm")
        sizes = [p.margin for p in self.passive] + ([] if self.skin is None else [self.skin])
        if any(not s > 0 for s in sizes):
            raise LatticeError(
                f"skin and margins of passive regions must be positive, got {sizes} mm; leave out "
                f"what is not wanted"
            )


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
    if domain.skin is not None:
        depth = domain.distance(points) if distance is None else distance
        phase[depth > -domain.skin] = SKIN
    if domain.passive:
        phase[passive_at(domain, points)] = KEPT
    return phase


def solid_fraction(domain: DesignDomain, mesh: TetMesh) -> FloatArray:
    """Solid volume fraction of every tetrahedron, counted on interior points, ``(M,)``."""
    if domain.skin is None and not domain.passive:
        return np.zeros(mesh.tets.shape[1])
    corners = mesh.points[:, mesh.tets]
    points = np.einsum("dcm,qc->dqm", corners, _interior_weights(FRACTION_SAMPLES))
    solid = phase_at(domain, points) != LATTICE
    return np.asarray(solid.mean(axis=0), dtype=np.float64)


def grown(domain: DesignDomain, overhang: float) -> DesignDomain:
    """The domain with its faces moved outward by ``overhang``, mm; inside, nothing moves."""
    inner = domain.distance
    return replace(
        domain,
        distance=lambda points: inner(points) - overhang,
        skin=None if domain.skin is None else domain.skin + overhang,
        lower=domain.lower - overhang,
        upper=domain.upper + overhang,
    )


def _interior_weights(n: int) -> FloatArray:
    """Barycentric coordinates of evenly spread interior points, ``(k, 4)``."""
    return np.array(
        [
            ((i + 0.25) / n, (j + 0.25) / n, (k + 0.25) / n, (n - 1 - i - j - k + 0.25) / n)
            for i in range(n)
            for j in range(n - i)
            for k in range(n - i - j)
        ]
    )
