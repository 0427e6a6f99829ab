"""The library of printed materials is complete, plausible and says where its figures come from."""

import pytest

from gradedesign.mechanics.material.library import builtin_materials

MATERIALS = builtin_materials()

#: E/rho in GPa/(g/cm^3). Steel, titanium, aluminium and nickel alloys lie near 25 when wrought
#: (Ashby, Materials Selection in Mechanical Design); printed, textured ones 15 to 30, unfilled
#: polymers 1 to 4. A wrong unit misses this by a factor of ten or more.
SPECIFIC_STIFFNESS = (1.0, 30.0)


@pytest.mark.parametrize("material", MATERIALS, ids=lambda m: m.name)
def test_figures_are_in_internal_units_and_plausible(material):
    assert 1e3 <= material.youngs_modulus <= 250e3
    assert 0.25 <= material.poissons_ratio <= 0.42
    assert 0.9e-9 <= material.density <= 9e-9
    low, high = SPECIFIC_STIFFNESS
    assert low <= material.youngs_modulus / 1e3 / (material.density * 1e9) <= high
    # elastic strain at yield of engineering alloys and rigid polymers: 0.2 % to 3 %
    assert 0.002 <= material.yield_strength / material.youngs_modulus <= 0.035
    assert 5e-6 <= material.thermal_expansion <= 150e-6


@pytest.mark.parametrize("material", MATERIALS, ids=lambda m: m.name)
def test_source_states_condition_and_what_was_not_traced(material):
    assert len(material.source) > 60
    assert (
        "Read: " in material.source
        or "no data sheet could be read" in material.source
        or ("no figure of a data sheet could be read" in material.source)
    )
    assert "Not traced: " in material.source
    assert "{" not in material.source


def test_names_are_unique_sorted_and_at_least_twelve():
    names = [m.name for m in MATERIALS]
    assert len(names) == len(set(names)) >= 12
    assert names == sorted(names)


def test_design_example_is_there():
    # design.md, section 5 names it; 825 MPa is the floor asked of annealed Ti-6Al-4V
    (material,) = (m for m in MATERIALS if m.name == "Ti-6Al-4V")
    assert material.yield_strength == 825.0
    assert material.density == pytest.approx(4.41e-9)
