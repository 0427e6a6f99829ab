"""Make bracket.stl: an angle bracket with four bolt holes, a filleted corner and a lug.

Run ``python make_part.py`` in this folder; needs what gradedesign installs.
Lengths in mm. The base lies in z = 0, the upright stands at x = 0, the lug's hole runs along y.
"""

from pathlib import Path

import numpy as np
import trimesh  # noqa: TID253
from manifold3d import CrossSection, Manifold  # noqa: TID253

# Cells of 22 mm and 1 mm around them: the struts on the faces are a little more than half struts.
LENGTH, WIDTH, HEIGHT = 112.0, 46.0, 68.0
WALL = 24.0
FILLET = 12.0
CHAMFER = 1.5
BOLT_DIAMETER = 9.0
SPOT_DIAMETER, SPOT_DEPTH = 16.0, 2.0
BOLTS = [(56.0, 12.0), (56.0, 34.0), (100.0, 12.0), (100.0, 34.0)]
LUG_HOLE, LUG_RADIUS, LUG_WIDTH = 12.0, 12.0, 20.0
LUG_X, LUG_Z = 12.0, 80.0
SEGMENTS = 64


def profile() -> CrossSection:
    """Outline in x and z of the angle, with a filleted inner and chamfered outer corners."""
    turn = np.linspace(0.0, np.pi / 2, 17)
    fillet = [
        (WALL + FILLET - FILLET * np.sin(a), WALL + FILLET - FILLET * np.cos(a)) for a in turn
    ]
    c = CHAMFER
    outline = [
        (0.0, c),
        (c, 0.0),
        (LENGTH - c, 0.0),
        (LENGTH, c),
        (LENGTH, WALL - c),
        (LENGTH - c, WALL),
        *fillet,
        (WALL, HEIGHT - c),
        (WALL - c, HEIGHT),
        (c, HEIGHT),
        (0.0, HEIGHT - c),
    ]
    return CrossSection([outline])


def along_y(section: CrossSection, y0: float, length: float) -> Manifold:
    """Extrude an x-z section along +y."""
    return section.extrude(length).rotate((90.0, 0.0, 0.0)).translate((0.0, y0 + length, 0.0))


def lug() -> Manifold:
    """Ear on top of the upright: a rounded tab."""
    head = CrossSection.circle(LUG_RADIUS, SEGMENTS).translate((LUG_X, LUG_Z))
    neck = CrossSection.square((2 * LUG_RADIUS, LUG_Z - HEIGHT + 2.0)).translate(
        (LUG_X - LUG_RADIUS, HEIGHT - 2.0)
    )
    return along_y(head + neck, (WIDTH - LUG_WIDTH) / 2, LUG_WIDTH)


def bracket() -> Manifold:
    """The whole part."""
    body = along_y(profile(), 0.0, WIDTH) + lug()
    hole = CrossSection.circle(LUG_HOLE / 2, SEGMENTS).translate((LUG_X, LUG_Z))
    body -= along_y(hole, -1.0, WIDTH + 2.0)
    for x, y in BOLTS:
        body -= Manifold.cylinder(WALL + 2.0, BOLT_DIAMETER / 2, -1.0, SEGMENTS).translate(
            (x, y, -1.0)
        )
        body -= Manifold.cylinder(SPOT_DEPTH + 1.0, SPOT_DIAMETER / 2, -1.0, SEGMENTS).translate(
            (x, y, WALL - SPOT_DEPTH)
        )
    return body


if __name__ == "__main__":
    part = bracket()
    mesh = part.to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    surface.export(Path(__file__).with_name("bracket.stl"))
    print(f"{part.num_tri()} triangles, {part.volume():.1f} mm^3, genus {part.genus()}")
