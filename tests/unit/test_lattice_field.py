"""Trim, skin, passive regions and the bands of distances; the field of a whole design."""

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.banded_distance import banded_distance
from gradedesign.geometry.lattice.components.joint import Joint
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import (
    LatticeDesign,
    cell_field,
    cell_gradient,
    density_at,
    lattice_field,
)
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume

SIZE = np.array([40.0, 20.0, 20.0])


def box_distance(points):
    half = SIZE.reshape(3, *[1] * (points.ndim - 1)) / 2
    away = np.abs(points - half) - half
    return np.linalg.norm(np.maximum(away, 0), axis=0) + np.minimum(away.max(axis=0), 0)


def gyroid_sheet(u):
    x, y, z = 2 * np.pi * u
    return np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))


_SORTED = np.sort(gyroid_sheet(np.random.default_rng(31).random((3, 200_000))))


def design(**changes):
    settings = {
        "cells": plain_cells(gyroid_sheet, *_SORTED),
        "cell_map": lambda p: p / 10.0,
        "cell_size": 10.0,
        "density": 0.3,
    }
    stated = {"distance": box_distance, "lower": [0, 0, 0], "upper": SIZE}
    stated |= {name: changes.pop(name) for name in ("upper", "components") if name in changes}
    return LatticeDesign(domain=DesignDomain(**stated), **(settings | changes))


def fine_points(n=80):
    axis = [(np.arange(m) + 0.5) * s / m for m, s in zip((2 * n, n, n), SIZE, strict=True)]
    return np.array(np.meshgrid(*axis, indexing="ij"))


def region_distance(points):
    return np.abs(points[0])


def test_band_is_exact_inside_and_on_the_right_side_outside():
    banded = banded_distance(box_distance, [0, 0, 0], SIZE, spacing=3.0, inner=2.5, outer=1.0)
    points = np.random.default_rng(19).uniform(-20, 60, size=(3, 20_000))
    exact, value = box_distance(points), banded(points)
    inside = (exact >= -2.5) & (exact <= 1.0)
    np.testing.assert_array_equal(value[inside], exact[inside])
    assert (value[exact > 1.0] > 1.0).all()
    assert (value[exact < -2.5] < -2.5).all()
    assert (np.abs(value) <= np.abs(exact) + 1e-12).all()


def test_band_saves_evaluations():
    asked = []

    def counting(points):
        asked.append(points[0].size)
        return box_distance(points)

    banded = banded_distance(counting, [0, 0, 0], SIZE, spacing=1.0, inner=1.0, outer=1.0)
    asked.clear()
    banded(fine_points(40))
    assert 0 < sum(asked) < 0.6 * 80 * 40 * 40


def test_field_is_negative_exactly_in_the_solid():
    """Against the set operations of the definition, point by point."""
    d = design(
        components=(Skin(thickness=1.2), PassiveRegion(to_place=region_distance, margin=3.0))
    )
    points = np.random.default_rng(23).uniform(-3, 43, size=(3, 50_000))
    distance = box_distance(points)
    cell = gyroid_sheet(points / 10) < np.quantile(_SORTED, 0.3)
    solid = (distance < 0) & (cell | (distance > -1.2) | (points[0] < 3.0))
    np.testing.assert_array_equal(lattice_field(d)(points) < 0, solid)
    np.testing.assert_array_equal(lattice_field(d, band=1.5)(points) < 0, solid)


def test_band_and_single_precision_keep_the_surface():
    d = design(
        components=(Skin(thickness=1.2), PassiveRegion(to_place=region_distance, margin=3.0))
    )
    box = ([0, 0, 0], SIZE, 0.5)
    exact = extract_surface(lattice_field(d), *box)
    quick = extract_surface(lattice_field(d, band=1.0, single=True), *box)
    assert len(quick.faces) == len(exact.faces)
    assert np.abs(quick.vertices - exact.vertices).max() < 1e-3


@pytest.mark.parametrize("rho", [0.15, 0.3, 0.6])
def test_uniform_lattice_has_its_density(rho):
    """Whole cells fill the box, so the share of solid is rho itself."""
    share = np.mean(lattice_field(design(density=rho))(fine_points()) < 0)
    assert share == pytest.approx(rho, abs=0.003)


def test_graded_lattice_follows_its_grid():
    """Mean over the first and last cell layer, linear from 0.15 to 0.55 along x."""
    values = np.broadcast_to(np.linspace(0.15, 0.55, 9)[:, None, None], (9, 2, 2))
    grid = DensityGrid(origin=[0, 0, 0], spacing=5.0, values=values)
    solid = lattice_field(design(density=grid))(fine_points()) < 0
    assert solid[:40].mean() == pytest.approx(0.20, abs=0.013)
    assert solid[-40:].mean() == pytest.approx(0.50, abs=0.013)
    assert solid.mean() == pytest.approx(0.35, abs=0.003)
    assert density_at(design(density=grid), np.array([[20.0], [3], [3]])) == pytest.approx(0.35)


def test_surface_volume_equals_the_field():
    d = design(components=(Skin(thickness=1.5),))
    surface = extract_surface(lattice_field(d, band=1.0), [0, 0, 0], SIZE, 0.5)
    share = np.mean(lattice_field(d)(fine_points()) < 0)
    assert enclosed_volume(surface) == pytest.approx(share * SIZE.prod(), rel=1e-2)


def test_gradient_of_a_distance_is_one():
    rods = design(
        cells=plain_cells(
            lambda u: np.hypot(*(u[:2] % 1 - 0.5)), *np.sqrt(np.linspace(0, 1, 1001) / np.pi)
        )
    )
    assert cell_gradient(rods) == pytest.approx(1.0, rel=1e-6)


def test_cell_values_are_about_millimetres():
    """One step from the surface along the normal changes the value by about that step."""
    cell = cell_field(design())
    surface = extract_surface(cell, [0] * 3, [10] * 3, 0.5)
    inner = surface.vertices[((surface.vertices > 1) & (surface.vertices < 9)).all(axis=1)].T
    slope = np.zeros_like(inner)
    for n, step in enumerate(1e-4 * np.eye(3)):
        slope[n] = (cell(inner + step[:, None]) - cell(inner - step[:, None])) / 2e-4
    length = np.linalg.norm(slope, axis=0)
    assert np.median(length) == pytest.approx(1.0, abs=0.1)
    assert length.min() > 0.6
    assert length.max() < 1.6


def test_parameters_reach_the_shape():
    d = design(cells=plain_cells(lambda u, lift: gyroid_sheet(u) + lift, lift=5.0))
    assert (lattice_field(d)(fine_points(10)) > 0).all()


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"upper": [40, 20, 0]}, "box is empty"),
        ({"cell_size": 0.0}, "cell size is 0 mm"),
        (
            {"components": lambda: PassiveRegion(to_place=region_distance, margin=0.0)},
            "be positive",
        ),
        ({"components": lambda: PassiveRegion(to_place=region_distance, margin=-1.0)}, "positive"),
        ({"components": lambda: Joint(radius=-0.5)}, "radius of joints must be positive"),
    ],
)
def test_impossible_designs_are_refused(changes, match):
    with pytest.raises(LatticeError, match=match):
        design(**{key: v() if callable(v) else v for key, v in changes.items()})


def test_constant_shape_is_refused():
    with pytest.raises(LatticeError, match="gradient 0"):
        lattice_field(design(cells=plain_cells(lambda u: np.ones(u.shape[1:]))))


def test_negative_band_is_refused():
    with pytest.raises(LatticeError, match="expected a positive reach"):
        lattice_field(design(), band=-1.0)
