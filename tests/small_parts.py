"""Cells and cases that several folders of tests build on."""

import numpy as np

from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.support_zones import SupportZone

#: Plates on the faces of the cell, a true distance.
WALLS = CellFamily(
    name="walls",
    shape=lambda u: np.abs(u - np.round(u)).min(axis=0),
    distance=True,
    open_void=False,
)

#: A box of two cells of 8 mm between two solid ends, which a run needs seconds for; tables of
#: the load case, limits and lattice follow.
SHORT_BAR = """
[case]
name = "short bar"
[part]
box = ["16 mm", "8 mm", "8 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "root"
margin = "1.5 mm"
[[keep]]
region = "tip"
margin = "1.5 mm"
"""
#: The same under a force across its end, whose displacement is limited.
SHEARED_BAR = (
    SHORT_BAR
    + """\
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.0125 mm"}]
"""
)


def held_bar(
    part,
    *,
    name="bar",
    material='name = "PA12"',
    regions="",
    load_case="pull",
    force="0 N, 0 N, -10 N",
):
    """Case of a part that is held at its least x and loaded at its greatest, up to its limits."""
    components = ", ".join(f'"{component}"' for component in force.split(", "))
    return f"""\
[case]
name = "{name}"
[part]
{part}
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
{regions}[material]
{material}
[[load_case]]
name = "{load_case}"
fix = [{{region = "root"}}]
load = [{{region = "tip", force = [{components}]}}]
"""


def box_part(x, y, z, mesh_size):
    """Lines of ``[part]`` for a box, mm."""
    return f'box = ["{x} mm", "{y} mm", "{z} mm"]\nmesh_size = "{mesh_size} mm"'


def prism(outline, triangles, height):
    """A polygon in x and y, mm, counterclockwise with its triangles, drawn up along z."""
    low = np.array([(x, y, 0.0) for x, y in outline])
    high = low + np.array([0.0, 0.0, height])
    n = len(outline)
    sides = [
        face
        for k in range(n)
        for face in ((k, (k + 1) % n, n + (k + 1) % n), (k, n + (k + 1) % n, n + k))
    ]
    caps = [(a + n, b + n, c + n) for a, b, c in triangles] + [(a, c, b) for a, b, c in triangles]
    return SurfaceMesh(vertices=np.concatenate([low, high]), faces=np.array(sides + caps))


def finned_block(thickness):
    """A block of 24 x 12 x 12 mm with a fin 6 mm high and 12 mm long on it, from x = 12 mm on."""
    x = 12.0 + thickness
    outline = [(0, 0), (24, 0), (24, 12), (x, 12), (x, 18), (12, 18), (12, 12), (0, 12)]
    triangles = [(0, 1, 2), (0, 2, 3), (0, 3, 6), (0, 6, 7), (3, 4, 5), (3, 5, 6)]
    return prism(outline, triangles, 12.0)


def zone_of(distance, radius, disturbed=None):
    """Zone of a support of which a distance is known; what it disturbs is as wide by default."""
    disturbed = radius if disturbed is None else disturbed
    return SupportZone(
        region="root",
        corners=np.zeros((0, 3, 3)),
        distance=distance,
        radius=radius,
        disturbed=disturbed,
    )
