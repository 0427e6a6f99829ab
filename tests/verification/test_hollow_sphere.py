"""Hollow sphere pressed at its pole: shell theory with Hertz' contact, and finite elements.

D. Raymont, thesis, Exeter 2011, section 6.2.3 (L1736): a nylon sphere of radius 25 mm with a shell
of 2.9 mm under 40 N between plates. He leaves out the material; a modulus of 2 GPa and Poisson's
ratio 0.3 give his numbers.
"""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from meshes import face, facets_where, mapped_mesh, solve_one, uniform

from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on

CASES = Path(__file__).parents[2] / "cases"
RADIUS, SHELL, YOUNG, POISSON, FORCE = 25.0, 2.9, 2000.0, 0.3, 40.0
#: Radius of Hertz' contact with a rigid plate, mm: a^3 = 3 F R (1 - nu^2) / (4 E).
CONTACT = (0.75 * FORCE * RADIUS * (1 - POISSON**2) / YOUNG) ** (1 / 3)
#: Displacement of the pole against the equator, mm, by curved quadratic quadrilaterals about the
#: axis (scikit-fem, Hertz' pressure): 0.042416 with 5,650 and 0.042420 with 22,050 unknowns.
AXISYMMETRIC = 0.04242


def test_stiffness_of_shell_and_contact_in_series():
    """His equation; he states 8.799e5 N/m and 0.045459 mm."""
    shell = 2.3 * YOUNG * SHELL**2 / (RADIUS * np.sqrt(1 - POISSON**2))
    contact = (4 / 3 * np.sqrt(RADIUS) * YOUNG) ** (2 / 3) * FORCE ** (1 / 3)
    stiffness = 1 / (1 / shell + 1 / contact)
    assert f"{1e3 * stiffness:.3e}" == "8.799e+05"
    assert f"{FORCE / stiffness:.6f}" == "0.045459"


def octant(rings, through, edge=CONTACT / RADIUS, flat=RADIUS):
    """An eighth of the sphere, fine below the contact at the pole on the z axis; perhaps cut."""
    patch, near, far = rings
    polar = np.concatenate(
        [
            np.linspace(0, edge, patch + 1),
            np.geomspace(edge, 0.35, near + 1)[1:],
            np.linspace(0.35, np.pi / 2, far + 1)[1:],
        ]
    )
    depths = np.expm1(3.2 * np.linspace(0, 1, through + 1)) / np.expm1(3.2)

    def place(u):
        # Squares about the corner of the unit square become arcs about the pole.
        ring, least = np.maximum(u[0], u[1]), np.minimum(u[0], u[1])
        turn = np.pi / 4 * np.divide(least, ring, out=np.zeros_like(ring), where=ring > 0)
        around = np.where(u[1] > u[0], np.pi / 2 - turn, turn)
        angle = np.interp(ring, np.linspace(0, 1, sum(rings) + 1), polar)
        outer = np.minimum(RADIUS, flat / np.maximum(np.cos(angle), 1e-9))
        radius = outer - (outer - RADIUS + SHELL) * np.interp(
            u[2], np.linspace(0, 1, through + 1), depths
        )
        across = np.sin(angle) * np.array([np.cos(around), np.sin(around)])
        points = radius * np.array([*across, np.cos(angle)])
        points[0, u[0] == 0] = points[1, u[1] == 0] = points[2, ring == 1] = 0.0
        return points

    return mapped_mesh((sum(rings), sum(rings), through), place)


def held_by_symmetry(space, mesh):
    return supports_on(
        space,
        [
            (face(mesh, 0, 0.0), (0.0, None, None)),
            (face(mesh, 1, 0.0), (None, 0.0, None)),
            (face(mesh, 2, 0.0), (None, None, 0.0)),
        ],
    )


@pytest.mark.slow
def test_finite_elements_under_the_pressure_of_the_contact():
    mesh = octant((4, 8, 8), 6)
    space = tet_space(mesh)
    held = held_by_symmetry(space, mesh)
    rim = RADIUS * np.sin(CONTACT / RADIUS)
    pressed = facets_where(
        mesh,
        lambda p: (
            (np.hypot(p[0], p[1]) < 1.001 * rim) & (np.linalg.norm(p, axis=0) > RADIUS - 1e-6)
        ),
    )

    def hertz(points):
        share = np.maximum(1 - (points[0] ** 2 + points[1] ** 2) / CONTACT**2, 0.0)
        down = 1.5 * FORCE / (np.pi * CONTACT**2) * np.sqrt(share)
        return np.stack([0 * down, 0 * down, -down])

    force = traction_force(space, pressed, hertz)
    assert -force[2].sum() == pytest.approx(FORCE / 4, rel=0.005)
    force *= FORCE / 4 / -force[2].sum()
    u = solve_one(space, uniform(space, YOUNG, POISSON), held, force).displacement
    pole = -u[2, np.argmax(space.nodes[2])]
    assert pole == pytest.approx(AXISYMMETRIC, rel=0.01)
    # The equation adds a thin shell to a half space, and its contact has E for E / (1 - nu^2).
    assert pole / 0.045459 == pytest.approx(0.933, abs=0.01)


def test_the_flat_on_which_the_lattice_sphere_stands():
    """The limit of cases/hollow-sphere: what the hollow one does under 40 N on the same flat.

    28,749 unknowns give 0.02347 mm, 70,227 give 0.02364 mm.
    """
    flat = 24.61
    mesh = octant((5, 5, 8), 3, np.arccos(flat / RADIUS), flat)
    space = tet_space(mesh)
    pressed = facets_where(mesh, lambda p: p[2] > flat - 1e-6)

    def even(points):
        return np.stack([0 * points[0], 0 * points[0], np.full_like(points[0], -1.0)])

    force = traction_force(space, pressed, even)
    assert -force[2].sum() == pytest.approx(np.pi / 4 * (RADIUS**2 - flat**2), rel=0.01)
    force *= FORCE / 4 / -force[2].sum()
    held = held_by_symmetry(space, mesh)
    u = solve_one(space, uniform(space, YOUNG, POISSON), held, force).displacement
    case = tomllib.loads((CASES / "hollow-sphere" / "case.toml").read_text(encoding="utf-8"))
    (limit,) = case["limits"]["displacement"]
    assert limit["magnitude"] == "0.0237 mm"
    assert np.abs(u[2, space.nodes[2] > flat - 1e-6]).max() == pytest.approx(0.0237, rel=0.01)
