"""Thick cylinder under internal pressure, plane strain (Lamé)."""

import numpy as np
import pytest
from meshes import face, facets_where, quarter_ring, solve_one, stress_at_vertex, uniform

from gradedesign.mechanics.fe.loads import pressure_force
from gradedesign.mechanics.fe.recovered_stress import recovered_stress
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress_percentile import stress_percentile
from gradedesign.mechanics.fe.supports import supports_on

INNER, OUTER, LENGTH = 100.0, 200.0, 10.0


def test_thick_cylinder():
    mesh = quarter_ring(16, 64)
    space = tet_space(mesh)
    inside = facets_where(mesh, lambda p: np.abs(np.hypot(p[0], p[1]) - INNER) < 1e-9)
    held = supports_on(
        space,
        [
            (face(mesh, 0, 0.0), (0.0, None, None)),
            (face(mesh, 1, 0.0), (None, 0.0, None)),
            (face(mesh, 2, 0.0), (None, None, 0.0)),
            (face(mesh, 2, LENGTH), (None, None, 0.0)),
        ],
    )
    material = uniform(space, 200e3, 0.3)
    u = solve_one(space, material, held, pressure_force(space, inside, 60.0)).displacement
    # Lamé's solution for 60 MPa: hoop p (b^2 + a^2) / (b^2 - a^2) = 100 MPa inside and
    # 2 p a^2 / (b^2 - a^2) = 40 MPa outside, axial nu (hoop + radial) = 12 MPa, and
    # u_r(a) = (1 + nu) a p / (E (b^2 - a^2)) ((1 - 2 nu) a^2 + b^2) = 5.72e-2 mm.
    for point, turned in [((INNER, 0.0, 0.0), False), ((0.0, INNER, LENGTH), True)]:
        stress = stress_at_vertex(space, material, u, point)
        radial, hoop = np.diag(stress)[[1, 0] if turned else [0, 1]]
        assert hoop == pytest.approx(100.0, rel=0.005)
        assert radial == pytest.approx(-60.0, rel=0.03)
        assert stress[2, 2] == pytest.approx(12.0, abs=0.5)
    hole = np.abs(np.hypot(*space.nodes[:2]) - INNER) < 1e-9
    growth = np.hypot(*u[:2])[hole]
    assert growth == pytest.approx(np.full(hole.sum(), 5.72e-2), rel=0.005)
    stress = stress_at_vertex(space, material, u, (OUTER, 0.0, 0.0))
    assert stress[1, 1] == pytest.approx(40.0, rel=0.005)
    # Von Mises stress falls outwards: a percentile by volume is its value on the cylinder within
    # which the rest of the volume lies. Radial and hoop stress are 20 MPa (1 -+ b^2 / r^2).
    recovered = recovered_stress(space, material, u)
    everywhere = np.ones((8, space.element_count))
    for percentile in (99.5, 90.0, 50.0):
        rest = 1.0 - percentile / 100.0
        away = 20.0 / ((INNER / OUTER) ** 2 * (1.0 - rest) + rest)
        exact = np.sqrt(3.0 * away**2 + (20.0 - 12.0) ** 2)
        found = stress_percentile(recovered, everywhere, percentile)
        assert found.value == pytest.approx(exact, rel=0.003)
        assert found.deviation < 0.02 * exact
