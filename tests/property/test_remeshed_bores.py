"""Bores of remeshed parts are found with their diameter; cones and waists hold no cylinder."""

import numpy as np
import pytest
from remeshed_bores import Bore, corners_of

from gradedesign.part.cylinders import cylinder_groups
from gradedesign.part.repair import build_surface
from gradedesign.part.smooth_faces import segment_faces

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


@pytest.mark.parametrize("seed", range(271, 281))
def test_remeshed_bores(seed):
    for bore in bores(seed, 12):
        surface, _ = build_surface(corners_of(bore))
        groups = cylinder_groups(segment_faces(surface))
        if not bore.straight:
            assert not groups, bore
            continue
        (group,) = groups
        assert group.concave, bore
        assert group.count == 1, bore
        # Corners lie between the circle and its chords, pi^2 / (2 former^2) of the radius inside.
        inside = np.pi**2 / (2.0 * bore.former**2) if bore.former else 0.0
        assert -1.2 * inside - 1e-3 < group.diameter / bore.diameter - 1.0 < 1e-3, bore
        wall = np.pi * bore.diameter * bore.straight
        # A row of facets may be lost or gained where a rim is rounded.
        row = np.pi * bore.diameter * bore.edge
        assert abs(group.area - wall) < row + 0.05 * wall, bore
