"""Make clevis.stl: a block bracket of 450 cm^3 with four bolt holes and a clevis for a pin.

Run ``python make_part.py`` in this folder; needs what gradedesign installs.
Lengths in mm. The base lies in z = 0; the pin runs along y through both ears.
"""

from pathlib import Path

import trimesh  # noqa: TID253
from manifold3d import CrossSection, Manifold  # noqa: TID253

LENGTH, WIDTH, BASE = 150.0, 72.0, 22.0
#: The block on the base: its ends along x at the base and at its top, and the height of its top.
FOOT, CROWN, TOP = (38.0, 112.0), (53.0, 97.0), 62.0
BOLT_DIAMETER = 11.0
BOLTS = [(18.0, 16.0), (18.0, 56.0), (132.0, 16.0), (132.0, 56.0)]
PIN_DIAMETER, PIN_X, PIN_Z = 16.0, 75.0, 84.0
EAR_RADIUS, EAR_WIDTH, GAP = 20.0, 21.0, 30.0
SEGMENTS = 72


def along_y(section: CrossSection, y0: float, length: float) -> Manifold:
    """Extrude an x-z section along +y."""
    return section.extrude(length).rotate((90.0, 0.0, 0.0)).translate((0.0, y0 + length, 0.0))


def block() -> Manifold:
    """Base and block as one profile."""
    outline = [
        (0.0, 0.0),
        (LENGTH, 0.0),
        (LENGTH, BASE),
        (FOOT[1], BASE),
        (CROWN[1], TOP),
        (CROWN[0], TOP),
        (FOOT[0], BASE),
        (0.0, BASE),
    ]
    return along_y(CrossSection([outline]), 0.0, WIDTH)


def ear(y0: float) -> Manifold:
    """One ear: a rounded tab on top of the block."""
    head = CrossSection.circle(EAR_RADIUS, SEGMENTS).translate((PIN_X, PIN_Z))
    neck = CrossSection.square((2 * EAR_RADIUS, PIN_Z - TOP + 2.0)).translate(
        (PIN_X - EAR_RADIUS, TOP - 2.0)
    )
    return along_y(head + neck, y0, EAR_WIDTH)


def clevis() -> Manifold:
    """The whole part."""
    inset = (WIDTH - GAP) / 2 - EAR_WIDTH
    body = block() + ear(inset) + ear(WIDTH - inset - EAR_WIDTH)
    pin = CrossSection.circle(PIN_DIAMETER / 2, SEGMENTS).translate((PIN_X, PIN_Z))
    body -= along_y(pin, -1.0, WIDTH + 2.0)
    for x, y in BOLTS:
        bolt = Manifold.cylinder(BASE + 2.0, BOLT_DIAMETER / 2, -1.0, SEGMENTS)
        body -= bolt.translate((x, y, -1.0))
    return body


if __name__ == "__main__":
    part = clevis()
    mesh = part.to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    surface.export(Path(__file__).with_name("clevis.stl"))
    print(f"{part.num_tri()} triangles, {part.volume():.1f} mm^3, genus {part.genus()}")
