"""The trimmed surface has the part's own faces and the exact volume."""

import numpy as np
import pytest
from plain_cells import plain_cells

from gradedesign.design.printing.feather_edges import feather_edges
from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.trim import trimmed_surface
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance
from gradedesign.geometry.triangles.surface_mesh import (
    area_vectors,
    enclosed_volume,
    open_edge_count,
)

SIZE = (12.0, 8.0, 8.0)


def _design(**changes) -> LatticeDesign:
    """Flat sheets of half a cell normal to y, so that every volume is known."""
    values = {
        "cells": plain_cells(lambda u: np.abs(np.mod(u[1], 1.0) - 0.5), 0.0, 0.5),
        "cell_map": lambda x: x / 8.0,
        "cell_size": 8.0,
        "density": 0.5,
    }
    domain = DesignDomain(
        distance=surface_distance(box_surface(SIZE)), lower=(0.0, 0.0, 0.0), upper=SIZE, **changes
    )
    return LatticeDesign(domain=domain, **values)


def test_a_plate_is_cut_exactly():
    """One plate 4 mm thick through the box: 12 x 4 x 8 mm^3, by geometry."""
    surface = trimmed_surface(_design(), box_surface(SIZE), 0.5)
    assert open_edge_count(surface) == 0
    assert enclosed_volume(surface) == pytest.approx(12 * 4 * 8, rel=1e-4)
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([12.0, 4.0, 8.0], abs=1e-3)


def test_faces_on_the_part_are_flat():
    """The two cut faces at x = 0 and x = 12 mm have 4 x 8 mm^2 each."""
    surface = trimmed_surface(_design(), box_surface(SIZE), 0.5)
    normals = area_vectors(surface)
    assert normals[normals[:, 0] > 0, 0].sum() == pytest.approx(32.0, rel=1e-3)


def test_skin_and_passive_regions_keep_their_depth():
    """A skin of 1 mm leaves a void of 10 x (6 - 4) x 6 mm^3 beside the plate."""
    surface = trimmed_surface(_design(components=(Skin(thickness=1.0),)), box_surface(SIZE), 0.25)
    assert enclosed_volume(surface) == pytest.approx(12 * 8 * 8 - 10 * 2 * 6, rel=3e-3)
    kept = PassiveRegion(to_place=lambda x: np.abs(x[0]), margin=2.0)
    surface = trimmed_surface(_design(components=(kept,)), box_surface(SIZE), 0.25)
    assert enclosed_volume(surface) == pytest.approx(2 * 64 + 10 * 32, rel=3e-3)


#: Sheets of 2 mm, 10 mm apart, in a bar whose long faces they cut at an angle to these.
BAR = (40.0, 8.0, 4.0)


def _slanted(angle_deg, least_rim=0.0) -> LatticeDesign:
    across = np.array([np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))])

    def sheets(u):
        along = across @ u[:2].reshape(2, -1) - 0.068  # no sheet ends at a corner of the bar
        return np.abs(along - np.round(along)).reshape(u.shape[1:])

    domain = DesignDomain(
        distance=surface_distance(box_surface(BAR)), lower=(0.0, 0.0, 0.0), upper=BAR,
        least_rim=least_rim,
    )  # fmt: skip
    return LatticeDesign(
        domain=domain, cells=plain_cells(sheets, 0.0, 0.5),
        cell_map=lambda x: x / 10.0, cell_size=10.0, density=0.2,
    )  # fmt: skip


def _sampled_volume(design):
    rng = np.random.default_rng(20_233)
    points = rng.random((3, 400_000)) * np.array(BAR)[:, None]
    return float((lattice_field(design, band=1.0)(points) < 0.0).mean() * np.prod(BAR))


@pytest.mark.parametrize("step", [0.5, 0.25])
def test_rims_of_flat_angles_are_trimmed_to_the_wall(step):
    """Sheets that meet the faces at 20 degrees, a wall of 0.8 mm.

    Their middles lie 0.68 + 10 n mm along their normal, from y = 0 to y = 8 they move by 8 / tan(20
    deg) against x. On y = 0 the end of greater x is a rim, on y = 8 that of lesser x.
    """
    cut, trimmed = (trimmed_surface(_slanted(20.0, rim), box_surface(BAR), step)
                    for rim in (0.0, 0.8))  # fmt: skip
    assert open_edge_count(trimmed) == 0
    before, after = feather_edges(cut, 0.8), feather_edges(trimmed, 0.8)
    sine, tangent = np.sin(np.radians(20.0)), np.tan(np.radians(20.0))
    low = [(10.0 * n + 0.68 + 1.0) / sine for n in range(-3, 6)]
    high = [(10.0 * n + 0.68 - 1.0) / sine - 8.0 / tangent for n in range(-3, 6)]
    width = 0.8 / tangent
    rims = [x for x in (*low, *high) if -width < x < 40.0 + width]
    assert len(rims) == len([x for x in rims if width < x < 40.0 - width]) == 4  # whole ones
    # Each is a prism of a triangle, thinner than the wall over the width, seen from two sides.
    assert before.area_mm2 == pytest.approx(len(rims) * 2 * 4.0 * width, rel=0.02)
    assert after.area_mm2 < 0.02 * before.area_mm2
    lost = len(rims) * 0.5 * 0.8 * width * 4.0
    volumes = enclosed_volume(cut), enclosed_volume(trimmed)
    # The end of what stays is square to the face within a part of a step: 4 mm x 0.8 mm each.
    assert volumes[0] - volumes[1] == pytest.approx(lost, abs=len(rims) * 4.0 * 0.8 * 0.2 * step)


def test_the_field_that_is_analysed_has_no_rims_either():
    with_rims, without = (_sampled_volume(_slanted(20.0, rim)) for rim in (0.0, 0.8))
    printed = [enclosed_volume(trimmed_surface(_slanted(20.0, rim), box_surface(BAR), 0.25))
               for rim in (0.0, 0.8)]  # fmt: skip
    # Three standard deviations of 400 000 random points in 1280 mm^3; the rims hold 14 mm^3.
    assert with_rims == pytest.approx(printed[0], abs=2.2)
    assert without == pytest.approx(printed[1], abs=2.2)
    assert printed[0] - printed[1] > 13.0
    # Steep edges stay as they are.
    steep = [_sampled_volume(_slanted(50.0, rim)) for rim in (0.0, 0.8)]
    assert steep[0] == steep[1]
