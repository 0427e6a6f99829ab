"""Supports that contradict each other: a part's surface says of random ones what its mesh does."""

from types import SimpleNamespace

import numpy as np
from hypothesis import event, given, settings
from hypothesis import strategies as st

from gradedesign.design.resolve.support_conflicts import require_agreeing
from gradedesign.errors import CaseError
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.part_mesh import box_part_mesh, region_facets
from gradedesign.geometry.part.regions import select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.smooth_faces import segment_faces
from gradedesign.mechanics.fe.load_schema import FixSpec
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on

BOX = (6.0, 4.0, 3.0)
SURFACE = box_surface(BOX)
FACES = segment_faces(SURFACE)
VALUES = ("free", "0 mm", "0.1 mm")


@st.composite
def regions(draw):
    """A face of the box, whole or what a box of whole millimetres leaves of it."""
    axis, end = draw(st.integers(0, 2)), draw(st.sampled_from(("min", "max")))
    spec = {"plane": f"{'xyz'[axis]} = {end}"}
    if draw(st.booleans()):
        lower, upper = [], []
        for k, edge in enumerate(BOX):
            first = draw(st.integers(0, int(edge) - 1))
            last = draw(st.integers(first + 1, int(edge)))
            lower.append("-1 mm" if k == axis else f"{first} mm")
            upper.append(f"{edge + 1:g} mm" if k == axis else f"{last} mm")
        spec |= {"box": {"lower": lower, "upper": upper}, "clip": True}
    return spec


@st.composite
def supports(draw):
    """Three prescriptions, at least one of which holds."""
    values = [draw(st.sampled_from(VALUES)) for _ in "xyz"]
    values[draw(st.integers(0, 2))] = draw(st.sampled_from(VALUES[1:]))
    return values


@settings(max_examples=100, deadline=None)
@given(st.tuples(regions(), regions()), st.tuples(supports(), supports()))
def test_the_surface_refuses_what_the_nodes_of_a_mesh_refuse(specs, held):
    """Nodes that two regions of a conforming mesh share are the oracle."""
    named = {name: RegionSpec.model_validate(s) for name, s in zip("ab", specs, strict=True)}
    found = select_regions(SURFACE, FACES, named)
    fixes = [
        FixSpec.model_validate({"region": name, "displacement": values})
        for name, values in zip("ab", held, strict=True)
    ]
    mesh = box_part_mesh(BOX, 1.0, [region.corners for region in found.values()])
    space = tet_space(mesh, 2)
    on = {
        name: region_facets(mesh, region.corners, tolerance=1e-6).facets
        for name, region in found.items()
    }
    refused = []
    load_cases = [SimpleNamespace(name="pull", fix=fixes)]
    part = SimpleNamespace(regions=found, diagonal=float(np.linalg.norm(BOX)))
    for check in (
        lambda: supports_on(space, [(on[fix.region], fix.displacement) for fix in fixes]),
        lambda: require_agreeing(load_cases, part, lambda key: f"case.toml: {key}"),
    ):
        try:
            check()
            refused.append(False)
        except CaseError:
            refused.append(True)
    event(f"refused: {refused[0]}")
    assert refused[0] == refused[1]
