"""A rectangular plate with a round hole under tension, to any accuracy."""

from __future__ import annotations

import numpy as np

#: Terms of each potential, and points on each stretch of the border.
TERMS, POINTS = 24, 200


def plate_stress(half_length, half_width):
    """Stress in a plate |x| < half_length, |y| < half_width with a hole of radius 1.

    Unit tension on the ends x = +-half_length, nothing on sides and hole. Kolosov's potentials in
    Laurent series, fitted by least squares along a quarter of the border (Muskhelishvili, Some
    basic problems of the mathematical theory of elasticity, section 32).

    Returns
    -------
    function
        Of x and y ``(n,)`` to the stress xx, yy, xy ``(3, n)``.
    """
    powers = np.arange(1 - 2 * TERMS, 2 * TERMS, 2)
    scale = np.where(powers > 0, np.hypot(half_length, half_width) ** -powers.astype(float), 1.0)

    def terms(z):
        first = scale * powers * z[:, None] ** (powers - 1)
        second = scale * powers * (powers - 1) * z[:, None] ** (powers - 2)
        mean = np.concatenate([4.0 * first.real, 0.0 * first.real], axis=1)
        rest = np.concatenate([2.0 * z.conj()[:, None] * second, 2.0 * first], axis=1)
        return np.array([(mean - rest.real) / 2, (mean + rest.real) / 2, rest.imag / 2])

    turn = np.linspace(0.0, np.pi / 2, POINTS)
    rows, wanted = [], []
    for z, normal, pull in (
        (np.exp(1j * turn), -np.exp(1j * turn), 0.0),
        (half_length + 1j * half_width * np.sin(turn), np.ones(POINTS), 1.0),
        (half_length * np.sin(turn) + 1j * half_width, 1j * np.ones(POINTS), 0.0),
    ):
        xx, yy, xy = terms(z)
        nx, ny = np.real(normal)[:, None], np.imag(normal)[:, None]
        rows += [xx * nx + xy * ny, xy * nx + yy * ny]
        wanted += [np.full(POINTS, pull), np.zeros(POINTS)]
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=1e-13)[0]
    return lambda x, y: terms(np.asarray(x) + 1j * np.asarray(y)) @ found
