"""Overhangs of lattice cells against Raymont, thesis 2011, table of section 6.2.1 (B10).

Level sets of his appendix A with 15 % solid on the side ``f >= k``. Shares of the total area are
those of a smooth mesh of 100 steps per cell (his areas depend on his mesh). Of his 10 orientations
by roll and pitch, turned about x after y, 9 are within 0.6 points of our extremes; the least of the
diamond is 1.1 points above ours, whose curve spans 1.9.
"""

import numpy as np
import pytest

from gradedesign.design.printing.overhang import directions, gathered_normals, overhang_fractions
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.triangles.surface_mesh import area_vectors

ANGLE = 40.0  # of 316L on a Realizer SLM
STEPS = 50


def gyroid(c, s, c2, _s2, _p):
    return 10 * (c[0] * s[1] + c[1] * s[2] + c[2] * s[0]) - 0.5 * (
        c2[0] * c2[1] + c2[1] * c2[2] + c2[2] * c2[0]
    )


def diamond(_c, _s, _c2, _s2, p):
    s, c = np.sin(p - np.pi / 4), np.cos(p - np.pi / 4)
    mixed = s[0] * c[1] * c[2] + c[0] * s[1] * c[2] + c[0] * c[1] * s[2]
    return 10 * (s.prod(axis=0) + mixed) - 0.7 * np.cos(4 * p).sum(axis=0) - 11


def appendix_neovius(c, s, _c2, s2, _p):
    doubled = s2[0] * s[1] + s2[1] * s[2] + s[0] * s2[2]
    doubled = doubled + s2[0] * c[2] + c[0] * s2[1] + c[1] * s2[2]
    return s.prod(axis=0) + c.prod(axis=0) - doubled


def w(c, _s, c2, _s2, _p):
    return 10 * (c[0] * c[1] + c[1] * c[2] + c[2] * c[0]) - 5 * c2.sum(axis=0) - 14


def pinched(c, _s, _c2, _s2, _p):
    pairs = c[0] * c[1] + c[1] * c[2] + c[2] * c[0]
    return -(2.25 * c.sum(axis=0) + 1.25 * pairs)


#: Level of 15 %, least and most share, and the roll and pitch at which he found them.
PUBLISHED = [
    (gyroid, 10.695, 0.081, 0.141, (356.4, 180.0), (0.0, 313.2)),
    (diamond, -2.1276, 0.113, 0.126, (349.2, 187.2), (225.0, 180.0)),
    (appendix_neovius, 1.5447, 0.111, 0.127, (207.0, 10.8), (181.8, 136.8)),
    (w, -1.6753, 0.105, 0.132, (300.6, 144.0), (226.8, 100.8)),
    (pinched, 2.8567, 0.103, 0.125, (289.8, 316.8), (248.4, 194.4)),
]


def uncapped(shape, level):
    """Mean normals and areas of the surface of one cell without its cut faces."""

    def field(points):
        p = 2 * np.pi * points
        parts = np.cos(p), np.sin(p), np.cos(2 * p), np.sin(2 * p), p
        return (level - shape(*parts)) / 60

    surface = extract_surface(field, [0.0] * 3, [1.0] * 3, 1 / STEPS)
    corners = surface.vertices[surface.faces]
    on_box = ((np.abs(corners) < 1e-3) | (np.abs(corners - 1) < 1e-3)).all(axis=1).any(axis=1)
    return gathered_normals(area_vectors(surface)[~on_box])


def turned(roll, pitch):
    """The build direction that is z turned by the pitch about y, then by the roll about x."""
    (a, b), (c, d) = ((np.sin(x), np.cos(x)) for x in np.radians((roll, pitch)))
    return np.array([[c, -a * d, b * d]])


@pytest.mark.parametrize(
    ("shape", "level", "least", "most", "at_least", "at_most"),
    PUBLISHED,
    ids=[row[0].__name__ for row in PUBLISHED],
)
def test_overhangs_of_the_published_cells(shape, level, least, most, at_least, at_most):
    normals, area = uncapped(shape, level)
    shares = overhang_fractions(normals, area, directions(3.6), ANGLE)
    assert shares.min() == pytest.approx(least, abs=0.01)
    assert shares.max() == pytest.approx(most, abs=0.01)
    there = overhang_fractions(normals, area, turned(*at_least), ANGLE)[0]
    assert there < shares.min() + (0.012 if shape is diamond else 0.006)
    there = overhang_fractions(normals, area, turned(*at_most), ANGLE)[0]
    assert there > shares.max() - 0.006
