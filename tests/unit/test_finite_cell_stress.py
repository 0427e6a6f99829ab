"""Stress and displacement at points of finite cells, against plain array expressions."""

import numpy as np
import pytest

from gradedesign.mechanics.finite_cell.basis import gauss_places, gradients_at, shapes_at
from gradedesign.mechanics.finite_cell.elements import cut_elements, solid_fraction, solid_volume
from gradedesign.mechanics.finite_cell.grid import fit_grid
from gradedesign.mechanics.finite_cell.recovery import WELL_FILLED, recovered_stress
from gradedesign.mechanics.finite_cell.space import brick_space
from gradedesign.mechanics.finite_cell.stress import (
    displacement_at,
    points_of,
    solid_parts,
    solid_points,
)

#: Of a material that is stiffest along y, MPa: any couplings, and shear moduli.
NORMAL = 1e3 * np.array([[280.0, 120, 90], [120, 330, 110], [90, 110, 250]])
SHEAR = 1e3 * np.array([[0.0, 80, 70], [80, 0, 60], [70, 60, 0]])
EXPANSION = 2e-4


def plain_stress(elements, space, u, element, reference):
    """Stress of the displacements themselves, ``(3, 3, m)``."""
    gradients = gradients_at(reference, elements.grid.edges)
    slope = np.einsum("mda,mac->cdm", gradients, u[space.nodes[element]])
    strain = (slope + np.swapaxes(slope, 0, 1)) / 2.0
    strain[range(3), range(3)] -= EXPANSION
    stress = 2.0 * SHEAR[:, :, None] * strain
    stress[range(3), range(3)] += NORMAL @ strain[range(3), range(3)]
    return stress


def trilinear(elements, space, u, element, reference):
    """The function through the stress at eight Gauss points of one element, at one place."""
    corners = plain_stress(elements, space, u, np.full(8, element), gauss_places(2))
    low, high = gauss_places(2)[0, :2]
    x, y, z = (reference - low) / (high - low)
    weights = [
        (x if k & 1 else 1 - x) * (y if k & 2 else 1 - y) * (z if k & 4 else 1 - z)
        for k in range(8)
    ]
    return corners @ np.array(weights)


def ball(points):
    return np.sqrt((points**2).sum(axis=0)) - 0.8


def test_stress_and_displacement_equal_plain_expressions():
    elements = cut_elements(ball, fit_grid([-1] * 3, [1, 1, 1.1], 0.5))
    space = brick_space(elements)
    u = np.random.default_rng(3).normal(size=(len(space.place), 3)) * 1e-3
    every = solid_points(elements)
    order = np.random.default_rng(4).permutation(every.volume.size)
    parts = solid_parts(elements)
    for at in (every, points_of(parts, order[:300]), points_of(parts, order[:0])):
        found = recovered_stress(elements, space, u, np.stack([NORMAL, SHEAR]), at, EXPANSION)
        assert found.shape == (3, 3, at.volume.size)
        filled = solid_fraction(elements)[at.element] >= WELL_FILLED
        plain = plain_stress(elements, space, u, at.element, at.reference)
        np.testing.assert_allclose(found[:, :, ~filled], plain[:, :, ~filled], atol=1e-9)
        for k in np.flatnonzero(filled)[:50]:
            wanted = trilinear(elements, space, u, at.element[k], at.reference[:, k])
            np.testing.assert_allclose(found[:, :, k], wanted, atol=1e-9)
        moved = displacement_at(elements, space, u, at.element, at.points)
        shapes = shapes_at(at.reference)
        wanted = np.einsum("ma,mac->cm", shapes, u[space.nodes[at.element]])
        np.testing.assert_allclose(moved, wanted, atol=1e-12)
    assert filled.size == 0


def test_points_of_chosen_parts_are_those_of_all():
    elements = cut_elements(ball, fit_grid([-1] * 3, [1, 1, 1.1], 0.25))
    assert 0 < elements.whole < len(elements.position)
    parts, every = solid_parts(elements), solid_points(elements)
    chosen = np.random.default_rng(5).permutation(every.volume.size)[:500]
    some = points_of(parts, chosen)
    np.testing.assert_array_equal(some.points, every.points[:, chosen])
    np.testing.assert_array_equal(some.volume, every.volume[chosen])
    np.testing.assert_array_equal(some.element, every.element[chosen])
    # Single precision of the shares; centroids of the solid lie within it or beside its facets.
    assert every.volume.sum() == pytest.approx(solid_volume(elements), rel=1e-6)
    mean = every.points @ every.volume / every.volume.sum()
    np.testing.assert_allclose(mean, 0.0, atol=2e-3)
    few = solid_parts(elements, 100)
    assert few.number.size <= 100
    assert np.isin(few.number, parts.number).all()
