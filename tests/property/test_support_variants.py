"""Supports of every kind leave out the stress where they make it singular, and nowhere else."""

import numpy as np
import pytest
from support_variants import KINDS, support_variants

from gradedesign.part.signed_distance import region_distance
from gradedesign.part.singular_supports import singular_supports


@pytest.mark.parametrize("made", support_variants(20 * len(KINDS), 2027), ids=lambda v: v.words[:9])
def test_what_a_support_leaves_out_is_known_by_first_principles(made):
    found = singular_supports([made.load_case], made.regions, made.surface)
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
    kinds = {made.words.split(":")[0] for made in support_variants(len(KINDS), 2027)}
    assert kinds == set(KINDS)
