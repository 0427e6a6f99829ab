"""Bores of remeshed parts are found with their diameter, cones with their angle, waists as none."""

import numpy as np
import pytest
from remeshed_bores import Bore, corners_of

from gradedesign.geometry.part.repair import build_surface
from gradedesign.geometry.part.round_shapes import round_shapes
from gradedesign.geometry.part.smooth_faces import segment_faces

SHAPES = ("plain", "rounded", "countersunk", "plain", "cone", "waist")


def bores(seed, count):
    """Bores of three rows of facets at least, since fewer may be a band of anything."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        shape = SHAPES[number % len(SHAPES)]
        diameter = float(np.exp(rng.uniform(np.log(3.0), np.log(40.0))))
        edge = np.pi * diameter / float(rng.uniform(16.0, 40.0))
        yield Bore(
            shape=shape,
            diameter=diameter,
            height=max(diameter * float(rng.uniform(0.6, 2.5)), 6.0 * edge),
            edge=edge,
            # Of facets as wide as today's a waist is made of short cylinders.
            former=int(rng.choice([0, 96] if shape == "waist" else [0, 32, 48, 96])),
            seed=int(rng.integers(1 << 30)),
        )


def sizes(bore):
    """Half angle in degrees and widest diameter in mm of the cone of a bore, by construction."""
    if bore.shape == "countersunk":  # at 45 degrees, over the upper 0.4 of the height
        return 45.0, bore.diameter + 2.0 * 0.4 * bore.height
    if bore.shape == "cone":
        return np.degrees(np.arctan(0.15 * bore.diameter / bore.height)), 1.3 * bore.diameter
    return None


@pytest.mark.parametrize(
    "seed", [271, *(pytest.param(k, marks=pytest.mark.slow) for k in range(272, 281))]
)
def test_remeshed_bores(seed):
    for bore in bores(seed, 12):
        surface, _ = build_surface(corners_of(bore))
        groups = {group.kind: group for group in round_shapes(surface, segment_faces(surface))}
        hole, cone = groups.pop("hole", None), groups.pop("countersink or inner cone", None)
        assert not groups, bore
        assert (hole is not None) == (bore.straight > 0.0), bore
        assert (cone is not None) == (sizes(bore) is not None), bore
        # Corners lie between the circle and its chords, pi^2 / (2 former^2) of the radius inside.
        inside = np.pi**2 / (2.0 * bore.former**2) if bore.former else 0.0
        if cone is not None:
            half_angle, widest = sizes(bore)
            assert cone.count == 1, bore
            # The radius, and so the tangent of the half angle, is as much less.
            loss = np.tan(np.radians(cone.half_angle)) / np.tan(np.radians(half_angle)) - 1.0
            assert -1.2 * inside - 1e-3 < loss < 1e-3, bore
            assert -1.2 * inside - 1e-3 < cone.diameter / widest - 1.0 < 1e-3, bore
        if hole is None:
            continue
        assert hole.count == 1, bore
        assert -1.2 * inside - 1e-3 < hole.diameter / bore.diameter - 1.0 < 1e-3, bore
        wall = np.pi * bore.diameter * bore.straight
        # A row of facets may be lost or gained where a rim is rounded.
        row = np.pi * bore.diameter * bore.edge
        assert abs(hole.area - wall) < row + 0.05 * wall, bore
