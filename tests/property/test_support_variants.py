"""Supports of every kind leave out the stress where they make it singular, and nowhere else."""

from types import SimpleNamespace

import numpy as np
import pytest
from support_variants import KINDS, support_variant

from gradedesign.design.resolve.symmetry import with_symmetry
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.mechanics.fe.singular_supports import singular_supports


@pytest.mark.parametrize("number", range(20 * len(KINDS)))
def test_what_a_support_leaves_out_is_known_by_first_principles(number):
    made = support_variant(number, 2027)
    diagonal = float(np.linalg.norm(np.ptp(made.surface.vertices, axis=0)))
    part = SimpleNamespace(surface=made.surface, regions=made.regions, diagonal=diagonal)
    load_cases = with_symmetry([made.load_case], part, lambda key: key)
    found = singular_supports(load_cases, made.regions, made.surface)
    for fix in load_cases[0].fix:
        # Symmetry holds the normal of its plane and nothing else.
        assert not fix.symmetry or [v is not None for v in fix.displacement].count(True) == 1
    assert {s.region for s in found if s.whole} == made.whole, made.words
    lines = {s.region: s for s in found if not s.whole}
    assert set(lines) == set(made.border), made.words
    for name, length in made.border.items():
        ends = lines[name].corners[:, 1] - lines[name].corners[:, 0]
        assert np.linalg.norm(ends, axis=1).sum() == pytest.approx(length, rel=1e-9), made.words
        # On the border itself nothing is far from it; the middle of the region is.
        at = region_distance(lines[name].corners)
        assert at(made.regions[name].centroid[:, None])[0] > 0.05 * length / 4
    for support in (s for s in found if s.whole):
        assert support.area == pytest.approx(made.regions[support.region].area, rel=1e-9)


def test_every_kind_is_among_the_variants():
    kinds = {support_variant(number, 2027).words.split(":")[0] for number in range(len(KINDS))}
    assert kinds == set(KINDS)
