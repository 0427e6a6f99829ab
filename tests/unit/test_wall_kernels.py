"""Growth of walls from facet to facet, against masks over all facets."""

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.geometry.part._clusters import find_clusters
from gradedesign.geometry.part._facet_sheet import facet_sheet
from gradedesign.geometry.part._wall_kernels import wall_facets
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

WIDEST, LEAST_FACING = np.cos(np.radians(31.0)), 0.02


@pytest.fixture(scope="module")
def sheet():
    """A turned part: a shaft, a cone and a bore in one row, with a rounded rim."""
    angles = np.linspace(0.0, 0.5 * np.pi, 6)
    rim = np.stack([5.0 + np.cos(angles), 14.0 + np.sin(angles)], axis=1)
    profile = [(2.0, 0.0), (8.0, 0.0), (8.0, 4.0), (6.0, 8.0), (6.0, 14.0), *rim[1:], (2.0, 15.0)]
    made = trimesh.creation.revolve([*profile, profile[0]], sections=24)
    made = made.subdivide()
    surface = SurfaceMesh(vertices=made.vertices, faces=made.faces)
    clusters = find_clusters(surface, 40.0)
    return facet_sheet(clusters, np.zeros(len(surface.faces), dtype=bool))


def grow(sheet, taken, facets, wall, tolerance, least):
    """The compiled growth, of at least so many of the facets."""
    return wall_facets(
        *(sheet.starts, sheet.beside, sheet.corners, sheet.clusters.facet_normals),
        *(sheet.clusters.facet_areas, taken, facets, wall),
        np.array([tolerance, WIDEST, LEAST_FACING, least]),
    )


def masked(sheet, taken, facets, wall, tolerance):
    """Sets of facets on a wall that hang together, -1 elsewhere; its sense, and those given."""
    axis, centre, radius, rise = wall[:3], wall[3:6], wall[6], wall[7]
    half = np.arctan(rise)
    offset = sheet.corners - centre
    along = offset @ axis
    outward = offset - along[..., None] * axis
    distance = np.linalg.norm(outward, axis=2)
    radii = radius + rise * along
    close = ((np.abs(distance - radii) * np.cos(half) <= tolerance) & (radii >= -tolerance)).all(1)
    apex = (distance <= 2.0 * tolerance) & (rise != 0.0)
    unit = outward / np.maximum(distance, 1e-300)[..., None]
    cosine = (unit * np.roll(unit, 1, axis=1)).sum(axis=2)
    narrow = np.where(apex | np.roll(apex, 1, axis=1), 1.0, cosine).min(axis=1) >= WIDEST
    middle = outward.mean(axis=1) / radius
    if rise:
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        middle = middle * np.cos(half) - axis * np.sin(half)
    facing = (middle * sheet.clusters.facet_normals).sum(axis=1)
    own = facets[close[facets]]
    sense = np.sign(facing[own] @ sheet.clusters.facet_areas[own])
    on = close & narrow & (sense * facing > LEAST_FACING) & ~taken
    pairs = sheet.pairs[on[sheet.pairs].all(axis=1)]
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=2 * (len(on),))
    part = connected_components(graph, directed=False)[1]
    return np.where(on, part, -1), sense, facets[on[facets]]


@pytest.mark.parametrize(
    ("radius", "height", "rise"),
    [(8.0, 2.0, 0.0), (7.0, 6.0, -0.5), (6.0, 11.0, 0.0), (2.0, 7.5, 0.0)],
    ids=["shaft", "cone", "neck", "bore"],
)
def test_walls_are_those_of_masks_over_all_facets(sheet, radius, height, rise):
    rng = np.random.default_rng(7)
    wall = np.array([0.0, 0.0, 1.0, 0.0, 0.0, height, radius, rise])
    middles = sheet.corners.mean(axis=1)
    from_wall = np.abs(np.hypot(*middles[:, :2].T) - radius) + np.abs(middles[:, 2] - height)
    sizes = set()
    for _ in range(12):
        facets = rng.permutation(np.argsort(from_wall)[:60])[:40]
        taken = rng.random(len(from_wall)) < rng.choice([0.0, 0.1, 0.3])
        tolerance = float(rng.choice([0.05, 0.1]))  # the chord error of the shaft is 0.07 mm
        part, sense, own = masked(sheet, taken, facets, wall, tolerance)
        grown, facing = grow(sheet, taken, facets, wall, tolerance, 1)
        assert facing == sense
        assert bool(len(grown)) == bool(len(own))
        if len(own):
            assert np.isin(own, grown).sum() == np.bincount(part[own]).max()
            assert np.array_equal(np.sort(grown), np.flatnonzero(part == part[grown[0]]))
        assert len(grow(sheet, taken, facets, wall, tolerance, len(own))[0]) == len(grown)
        assert not len(grow(sheet, taken, facets, wall, tolerance, len(own) + 1)[0])
        sizes.add(len(grown))
    assert len(sizes) > 1
