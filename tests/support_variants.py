"""Variants of supports on boxes, straight or turned, each with what makes stress singular.

By first principles, apart from the code they test: a plane that is held in its normal alone is a
mirror and disturbs nothing, but where it ends within a face that goes on; whatever is held along
itself is singular.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec

#: Kinds of variants, in turn.
KINDS = (
    "full",
    "normal",
    "tangent",
    "prescribed",
    "part of a face",
    "turned",
    "two planes",
    "symmetry",
)


@dataclass(frozen=True)
class Variant:
    """A box with the supports of a load case and what they must leave out.

    Attributes
    ----------
    words : str
    surface : SurfaceMesh
    regions : dict of str to Region
    load_case : LoadCaseSpec
    whole : set of str
        Regions that are left out with their faces.
    border : dict of str to float, mm
        Length of the border of others that is left out.
    """

    words: str
    surface: SurfaceMesh
    regions: dict
    load_case: LoadCaseSpec
    whole: set
    border: dict


def support_variant(number, seed):
    """A variant; kinds in turn."""
    kind, rng = KINDS[number % len(KINDS)], np.random.default_rng([seed, number])
    size = rng.uniform(8.0, 40.0, 3)
    axis, side = int(rng.integers(3)), int(rng.integers(2))
    specs = {"face": {"plane": f"{'xyz'[axis]} = {('min', 'max')[side]}"}}
    across = [c for c in range(3) if c != axis]
    whole, border, more, turn = set(), {}, [], None
    if kind == "full":
        fix, whole = {}, {"face"}
    elif kind == "normal":
        fix = {"components": "xyz"[axis]}
    elif kind == "tangent":
        sets = [s for n in (1, 2) for s in combinations(range(3), n) if s != (axis,)]
        fix, whole = {"components": letters(sets[rng.integers(len(sets))])}, {"face"}
    elif kind == "prescribed":
        along = bool(rng.integers(2))
        values = ["free"] * 3
        values[axis] = f"{rng.uniform(-0.2, 0.2):.3f} mm"
        if along:
            values[across[int(rng.integers(2))]] = "0 mm"
        fix, whole = {"displacement": values}, {"face"} if along else set()
    elif kind == "symmetry":
        fix = {"symmetry": True}
    elif kind == "part of a face":
        low, high = [-1.0] * 3, list(size + 1.0)
        first, second = (
            rng.uniform(0.2, 0.4, 2) * size[across],
            rng.uniform(0.6, 0.9, 2) * size[across],
        )
        for place, c in enumerate(across):
            low[c], high[c] = first[place], second[place]
        specs["face"] |= {
            "box": {"lower": [f"{v} mm" for v in low], "upper": [f"{v} mm" for v in high]},
            "clip": True,
        }
        fix = {"components": "xyz"[axis]}
        border = {"face": 2 * float((second - first).sum())}
    elif kind == "turned":
        turn, fix, whole = rng.uniform(3.0, 42.0), {"components": "x"}, {"face"}
        middle = turned(turn) @ np.array([0.0, *(0.5 * size[1:])])
        specs = {"face": {"nearest": [f"{v} mm" for v in middle]}}
    else:
        other = across[0]
        specs["second"] = {"plane": f"{'xyz'[other]} = min"}
        fix, more = {"components": "xyz"[axis]}, [("second", {"components": "xyz"[other]})]
    surface = box_surface(size)
    if turn is not None:
        surface = SurfaceMesh(vertices=surface.vertices @ turned(turn).T, faces=surface.faces)
    regions = select_regions(
        surface, segment_faces(surface), {name: RegionSpec(**spec) for name, spec in specs.items()}
    )
    return Variant(
        words=f"{kind}: {specs}, {fix}, {more}, size {size}",
        surface=surface,
        regions=regions,
        load_case=LoadCaseSpec(
            name="case",
            fix=[FixSpec(region="face", **fix), *(FixSpec(region=r, **f) for r, f in more)],
            temperature_change="10 K",
        ),
        whole=whole,
        border=border,
    )


def turned(degrees):
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def letters(components):
    return "".join("xyz"[c] for c in components)
