"""Make engine-bracket.stl: a mount of 450 cm^3 with four bolts and a clevis for a pin.

Run ``python make_part.py`` in this folder; needs what gradedesign installs.
Lengths in mm. The base lies in z = 0; the pin runs along y through both ears.
"""

from pathlib import Path

import numpy as np
import trimesh  # noqa: TID253
from manifold3d import CrossSection, Manifold  # noqa: TID253

LENGTH, WIDTH, HEIGHT, BASE, CORNER = 178.0, 108.0, 62.0, 20.0, 14.0
#: The block on the base: its ends along x at the base and at its top, the top's height, its width.
FOOT, CROWN, TOP, BLOCK_WIDTH = (46.0, 132.0), (58.0, 120.0), 34.0, 66.0
BOLT_DIAMETER = 10.4
BOLTS = [(17.0, 17.0), (17.0, 91.0), (161.0, 17.0), (161.0, 91.0)]
PIN_DIAMETER, EAR_RADIUS, EAR_WIDTH, GAP = 19.0, 17.0, 15.0, 26.0
PIN_X, PIN_Z = LENGTH / 2, HEIGHT - EAR_RADIUS
SEGMENTS = 72


def along_y(section: CrossSection, y0: float, length: float) -> Manifold:
    """Extrude an x-z section along +y."""
    return section.extrude(length).rotate((90.0, 0.0, 0.0)).translate((0.0, y0 + length, 0.0))


def base() -> Manifold:
    """A plate with rounded corners."""
    inner = CrossSection.square((LENGTH - 2 * CORNER, WIDTH - 2 * CORNER))
    corner = CrossSection.circle(CORNER, SEGMENTS)
    places = [(0.0, 0.0), (LENGTH - 2 * CORNER, 0.0)]
    places += [(x, WIDTH - 2 * CORNER) for x, _ in places]
    outline = CrossSection.batch_hull([inner, *(corner.translate(place) for place in places)])
    return outline.translate((CORNER, CORNER)).extrude(BASE)


def block() -> Manifold:
    """What carries the ears: narrower towards its top."""
    outline = [(FOOT[0], 0.0), (FOOT[1], 0.0), (FOOT[1], BASE), (CROWN[1], TOP), (CROWN[0], TOP)]
    outline.append((FOOT[0], BASE))
    return along_y(CrossSection([outline]), (WIDTH - BLOCK_WIDTH) / 2, BLOCK_WIDTH)


def ear(y0: float) -> Manifold:
    """One ear: a rounded tab on top of the block."""
    head = CrossSection.circle(EAR_RADIUS, SEGMENTS).translate((PIN_X, PIN_Z))
    neck = CrossSection.square((2 * EAR_RADIUS, PIN_Z - BASE)).translate((PIN_X - EAR_RADIUS, BASE))
    return along_y(head + neck, y0, EAR_WIDTH)


def bracket() -> Manifold:
    """The whole part."""
    middle, reach = WIDTH / 2, EAR_WIDTH + GAP / 2
    body = base() + block() + ear(middle - reach) + ear(middle + GAP / 2)
    # Between the ears the block ends below the pin.
    lug = CrossSection.circle(EAR_RADIUS + 2.0, SEGMENTS).translate((PIN_X, PIN_Z))
    body -= along_y(lug, middle - GAP / 2, GAP)
    pin = CrossSection.circle(PIN_DIAMETER / 2, SEGMENTS).translate((PIN_X, PIN_Z))
    body -= along_y(pin, -1.0, WIDTH + 2.0)
    for x, y in BOLTS:
        bolt = Manifold.cylinder(BASE + 2.0, BOLT_DIAMETER / 2, -1.0, SEGMENTS)
        body -= bolt.translate((x, y, -1.0))
    return body


if __name__ == "__main__":
    part = bracket()
    mesh = part.to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    surface.export(Path(__file__).with_name("engine-bracket.stl"))
    size = np.asarray(part.bounding_box())
    print(f"{part.num_tri()} triangles, {part.volume():.1f} mm^3, genus {part.genus()}")
    print("box", *(f"{value:g}" for value in size[3:] - size[:3]), "mm")
