"""Buckling of a lattice in waves of many cells under a macroscopic stress, from its stiffness.

A wave ``m exp(i k n x)`` much longer than a cell strains the lattice by ``E = (m n + n m) / 2`` and
turns it. It grows without resistance where the stiffness ``C`` and the work of the stress ``S``
vanish together, ``E : C : E + n S n + SWAY S : E^2 = 0`` with unit ``m`` and ``n``: there the
homogenised tangent stiffness loses rank-one convexity, which is the long-wave limit of the modes of
Bloch (Geymonat, Mueller and Triantafyllidis, Arch. Rational Mech. Anal. 122 (1993) 231). ``C`` is
that of small strains about the unloaded lattice, ``S`` the stress of the linear analysis times the
load factor. Of the work of the local stress on two gradients of displacement that of their means is
exact, since the stress is in balance; that of their fluctuation in the cell `SWAY` estimates.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gradedesign.arrays import VOIGT, VOIGT_COUNTS, VOIGT_PLACES, FloatArray
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: Work of the stress on how struts turn beside the lattice's mean rotation, over that on its mean
#: strain. Where joints follow the mean strain it is 6 / (5 - 10 e) - 1 for slender struts with
#: stiff ends of share e: 0.2 without, 0.43 in a simple cubic frame of density 0.2 whose joints are
#: as stiff as its table says. Taken for all cells; it lowers critical stresses by 10 to 18 %.
SWAY = 0.4
#: Steps of the search for the worst direction: half the distance of the directions it starts from,
#: and one that leaves 0.1 % of the use (150 stiffnesses with up to 30 times softer shears).
_FIRST_STEP, _LAST_STEP = 0.25, 0.01
#: Uses up to this are not worth the search: `_most` bounds them from above. Chosen, not measured.
_NEGLIGIBLE = 0.01
#: Uses of a stress as large as Young's modulus below this are rounding: cells buckle at less than
#: that stress, and a use of nothing comes out as 5e-9.
_ROUNDING = 1e-6
#: Densities at which the least resistance of a law is kept. Chosen, not measured.
_KNOTS = 64


def long_wave_use(
    law: ScalingLaw, stress: FloatArray, rho: FloatArray, negligible: float = _NEGLIGIBLE
) -> FloatArray:
    """Share of its resistance against long waves that a lattice uses.

    Returns ``(n,)``: 1 where the lattice buckles; 0 where no load of this kind buckles it.

    - ``stress (6, n)``: macroscopic Voigt stress in the cell's axes over the base material's
      Young's modulus
    - ``rho (n,)``: beyond the law's window, which only trimmed cells leave, the stiffness is taken
      to change in proportion to the solid
    - ``negligible``: where the use is at most this, an upper bound that is at most this may stand
      for it
    """
    inside = np.clip(rho, *law.window)
    use = _most(law, stress, inside)
    some = np.flatnonzero(use * inside / rho > negligible)
    if some.size:
        use[some], _ = _searched(stress[:, some], law.stiffness(inside[some]))
    return np.asarray(use * inside / rho)


def critical_long_waves(stiffness: FloatArray) -> FloatArray:
    """Size ``(6, 2)`` of each Voigt component of stress, negative and positive, alone.

    Over the base material's Young's modulus, as the stiffness ``(6, 6)``; infinite where it buckles
    nothing.

    Examples
    --------
    >>> stiffness = np.diag([0.1, 0.1, 0.1, 0.002, 0.002, 0.002])
    >>> critical_long_waves(stiffness)[0].round(4).tolist()  # compression, tension
    [0.0018, inf]
    """
    stress = np.concatenate([-np.eye(6), np.eye(6)], axis=1)
    use, _ = _searched(stress, np.repeat(stiffness[:, :, None], 12, axis=2))
    use[use < _ROUNDING] = 0.0
    with np.errstate(divide="ignore"):
        return np.asarray((1 / use).reshape(2, 6).T)


def long_wave_slopes(
    law: ScalingLaw, stress: FloatArray, rho: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of `long_wave_use` by stress, ``(6, n)``, and by density, ``(n,)``.

    Those of the wave that uses most, whose direction and amplitude make the use stationary; zero
    where no wave is compressed.
    """
    inside = np.clip(rho, *law.window)
    stiffness = law.stiffness(inside)
    use, n = _searched(stress, stiffness)
    strain_of, work = _wave(n, stress)
    resistance = np.einsum("aik,abk,bjk->kij", strain_of, stiffness, strain_of)
    # The amplitude m of the greatest m G m / m Q m.
    lower = np.linalg.inv(np.linalg.cholesky(resistance))
    _, vectors = np.linalg.eigh(lower @ np.moveaxis(work, -1, 0) @ np.swapaxes(lower, 1, 2))
    m = np.einsum("kji,kj->ik", lower, vectors[:, :, -1])  # m Q m = 1
    strain = np.einsum("aik,ik->ak", strain_of, m)
    tensor = (m[:, None] * n + n[:, None] * m) / 2
    turned = (m**2).sum(axis=0) * n[:, None] * n + SWAY * np.einsum("ijk,jlk->ilk", tensor, tensor)
    by_stress = -turned[VOIGT_PLACES] * VOIGT_COUNTS[:, None]
    softer = np.einsum("ak,abk,bk->k", strain, law.stiffness_derivative(inside), strain)
    share = inside / rho
    by_rho = np.where(inside == rho, -use * softer, -use * share / rho)
    some = use > 0
    return np.where(some, by_stress * share, 0.0), np.where(some, by_rho, 0.0)


def _wave(n: FloatArray, stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of waves along ``n``, (3, k): their strain of an amplitude, and the work of the stress.

    ``(6, 3, k)``, engineering shears, and ``(3, 3, k)``.
    """
    zero = np.zeros_like(n[0])
    x, y, z = n
    strain = np.array([[x, zero, zero], [zero, y, zero], [zero, zero, z],
                       [zero, z, y], [z, zero, x], [y, x, zero]])  # fmt: skip
    S = stress[VOIGT]
    across = np.einsum("ijk,jk->ik", S, n)
    along = (n * across).sum(axis=0)
    unit = np.eye(3)[:, :, None]
    mixed = n[:, None] * across + across[:, None] * n
    return strain, -along * unit - SWAY / 4 * (along * unit + mixed + S)


def _searched(stress: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Use ``(n,)`` and wave ``(3, n)`` of stresses ``(6, n)`` with stiffnesses ``(6, 6, n)``."""
    # Compiled code loads slowly.
    from gradedesign.common.system.threads import in_ranges
    from gradedesign.mechanics.material._wave_kernels import most_used

    use, along = np.zeros(stress.shape[1]), np.zeros((3, stress.shape[1]))
    in_ranges(
        most_used,
        range(use.size),
        np.ascontiguousarray(stress, dtype=np.float64),
        np.ascontiguousarray(stiffness, dtype=np.float64),
        _STARTS,
        SWAY,
        _FIRST_STEP,
        _LAST_STEP,
        use,
        along,
    )
    return np.maximum(use, 0.0), along


def _most(law: ScalingLaw, stress: FloatArray, rho: FloatArray) -> FloatArray:
    """Upper bound of the use, ``(n,)``: the largest compression over the least resistance."""
    least = np.linalg.eigvalsh(np.moveaxis(stress[VOIGT], (0, 1), (-2, -1)))[:, 0]
    knots, resistance = _least_resistance(law)
    below = np.clip(np.searchsorted(knots, rho, side="right") - 1, 0, knots.size - 1)
    return np.asarray((1 + SWAY) * np.maximum(-least, 0.0) / resistance[below])


@lru_cache(maxsize=16)
def _least_resistance(law: ScalingLaw) -> tuple[FloatArray, FloatArray]:
    """Densities, and ``E : C : E`` of a wave there at least; stiffness grows between them.

    ``E : E`` is a half at least.
    """
    rho = np.clip(np.geomspace(*law.window, _KNOTS), *law.window)
    kelvin = np.sqrt(VOIGT_COUNTS)
    stiffness = np.moveaxis(law.stiffness(rho), -1, 0) * np.outer(kelvin, kelvin)
    return rho, np.asarray(0.5 * np.linalg.eigvalsh(stiffness)[:, 0], dtype=np.float64)


def _starts() -> FloatArray:
    """Directions ``(49, 3)``, one of each pair of opposite ones: the crystal axes and between."""
    step = np.arange(-2.0, 3.0)
    points = np.stack(np.meshgrid(step, step, step, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.abs(points).max(axis=1) == 2]
    first = points[np.arange(len(points)), np.argmax(points != 0, axis=1)]
    points = points[first > 0]
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


_STARTS = _starts()
