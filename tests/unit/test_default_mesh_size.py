"""Mesh size of a part where the case states none."""

import pytest
from small_parts import box_part, held_bar

from gradedesign import load_case, run
from gradedesign.design.resolve.fitting_part import part_of
from gradedesign.design.resolve.predicted_part_mesh import (
    LEAST_DOFS,
    MOST_DOFS,
    predicted_part_dofs,
    with_mesh_size,
)


def case_of(folder, edges, cell, more=""):
    """A held bar without a mesh size."""
    text = held_bar(
        box_part(*edges, 1.0),
        name="bar",
        material='name = "Ti-6Al-4V"',
        load_case="shear",
        force="0 N, 0 N, -400 N",
    )
    text = text.replace('mesh_size = "1.0 mm"\n', "")
    assert "mesh_size" not in text
    text += "[limits]\nsafety_factor = 2\n"
    text += 'displacement = [{region = "tip", magnitude = "1 mm"}]\n'
    text += f'[lattice]\ncell = "bcc"\nsize = "{cell} mm"\n{more}'
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return load_case(folder / "case.toml")


@pytest.mark.parametrize("scale", [0.3, 1.0, 40.0])
@pytest.mark.parametrize("edges", [(60, 20, 20), (200, 100, 6), (80, 80, 80)])
def test_elements_follow_thickness_cells_and_unknowns(tmp_path, edges, scale):
    edges = tuple(scale * edge for edge in edges)
    case = case_of(tmp_path, edges, 10 * scale)
    part = part_of(case, {})
    known = with_mesh_size(case.part, part, case.lattice.cell_size)
    size = known.element_size
    x, y, z = edges
    thickness = x * y * z / (x * y + y * z + z * x)
    assert size <= min(thickness / 1.5, 10 * scale)
    assert LEAST_DOFS <= predicted_part_dofs(known, part) <= MOST_DOFS


def test_what_is_stated_stays(tmp_path):
    case = case_of(tmp_path, (60, 20, 20), 10)
    stated = case.part.model_copy(update={"mesh_size": 7.0})
    assert with_mesh_size(stated, part_of(case, {}), 10.0).element_size == 7.0


def test_a_run_takes_it(tmp_path):
    case = case_of(tmp_path, (60, 20, 20), 10, '[run]\nstop_after = "solid"\n')
    result = run(case, folder=tmp_path / "out")
    assert result.status == "partial"
    # A cantilever that bends and shears: 400 N on 60 mm, within the few per cent of both theories.
    (row,) = [row for row in result.solid if row.name.startswith("displacement")]
    stiffness, area = 110000.0, 400.0
    bent = 400.0 * 60.0**3 / (3 * stiffness * 20.0**4 / 12)
    sheared = 400.0 * 60.0 / (5 / 6 * stiffness / 2.68 * area)
    assert row.value == pytest.approx(bent + sheared, rel=0.05)
