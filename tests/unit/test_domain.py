"""The design domain says in one place what is skin, passive solid and lattice."""

import numpy as np
import pytest

from gradedesign.geometry.lattice.components.passive import PassiveRegion
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import (
    KEPT,
    LATTICE,
    SKIN,
    DesignDomain,
    grown,
    phase_at,
    solid_at,
)
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.signed_distance import surface_distance

SIZE = (12.0, 8.0, 8.0)
#: Along x, 4 mm from the nearest face across: passive to 3 mm, skin from 11 mm.
LINE = np.array([[1.0, 2.9, 3.1, 6.0, 10.9, 11.1], [4.0] * 6, [4.0] * 6])


def domain(**changes):
    stated = {
        "distance": surface_distance(box_surface(SIZE)), "lower": (0, 0, 0), "upper": SIZE,
        "components": (
            Skin(thickness=1.0), PassiveRegion(to_place=lambda x: np.abs(x[0]), margin=3.0)
        ),
    }  # fmt: skip
    return DesignDomain(**(stated | changes))


def test_a_point_has_one_phase_and_passive_regions_come_first():
    phases = [KEPT, KEPT, LATTICE, LATTICE, LATTICE, SKIN]
    assert phase_at(domain(), LINE).tolist() == phases
    assert phase_at(domain(), LINE, domain().distance(LINE)).tolist() == phases
    assert solid_at(domain(), LINE).tolist() == [True, True, False, False, False, True]
    assert phase_at(domain(components=()), LINE).tolist() == [LATTICE] * 6


def test_a_grown_domain_moves_its_faces_only():
    larger = grown(domain(), 0.5)
    assert larger.distance(LINE) == pytest.approx(domain().distance(LINE) - 0.5)
    assert phase_at(larger, LINE).tolist() == phase_at(domain(), LINE).tolist()
    np.testing.assert_allclose(larger.upper - larger.lower, np.add(SIZE, 1.0))
