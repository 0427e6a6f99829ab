"""Records in a notebook: the scene of preview and report in a frame, tables, short texts."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from html import unescape
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

import gradedesign
from gradedesign import CellFamily, SurfaceFields, TetMesh, load_case, load_part
from gradedesign.commands import RunResult
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.errors import CaseError
from gradedesign.geometry.part.box import box_surface
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands import notebook
from gradedesign.program.pictures.pictures import surface_still
from gradedesign.program.pictures.run_scene import surface_scene
from gradedesign.properties import calibrate

CASES = Path(__file__).parents[2] / "cases"


def scene_in(html):
    """Title and data of the scene that a frame holds."""
    frame = re.fullmatch(
        r'<iframe sandbox="allow-scripts" [^>]*? title="[^"]+" srcdoc="([^"]*)"></iframe>', html
    )
    page = unescape(frame[1])
    assert "connect-src" not in page
    data = re.search(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)[1]
    return page, json.loads(data)


def result_of(folder, **fields):
    key = LimitKey(kind="displacement", load_case="shear")
    row = LimitRow(
        key=key, name="displacement of tip", load_case="shear", value=0.05, limit=0.062, unit="mm",
        judged_by="finite cells", band=Banded(value=0.05, low=0.048, high=0.055),
    )  # fmt: skip
    limit = LimitIteration(
        key=key, name=row.name, unit="mm", predicted=0.06, explicit=0.05, discrepancy=-1 / 6,
        factor=1.0,
    )  # fmt: skip
    iteration = Iteration(
        number=1, lattice_mass_g=3.0, mass_g=4.0, mean_density=0.4, limits=(limit,),
        utilisation=0.9, passed=True, dofs=900, mesh_size_mm=1.0, spacing_mm=0.5, seconds=2.0,
        stiffness_factor=1.0, sizing_iterations=9, sizing_converged=True,
    )  # fmt: skip
    return RunResult(
        status="met", lightest=True, reason="all limits hold", limits=(row,), folder=folder,
        iterations=(iteration,), mass_g=4.0, **fields,
    )  # fmt: skip


def test_a_case_and_its_part_show_the_scene_of_preview():
    page, data = scene_in(load_case(CASES / "mini")._repr_html_())
    assert "no rigid motion is left free" in page
    assert [view["title"] for view in data["views"]] == ["Part and loads", "Cells"]
    part = load_part(CASES / "mini")
    _, data = scene_in(part._repr_html_())
    assert {region["name"] for region in data["regions"]} == {"root", "tip"} == set(part.regions)
    assert data["box"] == [[0, 0, 0], [24, 12, 12]]


def test_a_case_with_a_mistake_shows_its_lines(tmp_path):
    text = (CASES / "mini" / "case.toml").read_text("utf-8")
    wrong = text.replace(
        'fix = [{region = "root"}]',
        'fix = [{region = "root", displacement = ["0 mm", "free", "free"]}]',
    )
    (tmp_path / "case.toml").write_text(wrong, encoding="utf-8")
    page, _ = scene_in(load_case(tmp_path)._repr_html_())
    assert "The case has a mistake." in page


def test_a_result_shows_the_scene_of_its_run(tmp_path):
    surface = box_surface((2.0, 3.0, 5.0))
    scene = surface_scene(surface, "bar")
    (tmp_path / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
    result = result_of(tmp_path)
    page, data = scene_in(result._repr_html_())
    assert "MET, lightest: all limits hold" in page
    assert data == {**scene, "watch": ""}
    (tmp_path / "scene.json").unlink()
    assert result._repr_html_() is None
    assert len(repr(result).splitlines()) < 24


def test_a_page_that_is_too_large_is_a_still(monkeypatch):
    surface = box_surface((2.0, 3.0, 5.0))
    monkeypatch.setattr(notebook, "_MOST", 100_000)
    html = surface._repr_html_()
    assert html.startswith("<p>12 triangles, 2 x 3 x 5</p><img ")
    assert len(surface_still(surface, "x")) * 1.3 < len(html) < 200_000


def test_cells_show_two_along_each_axis_at_a_stated_density():
    def shape(u):
        return np.cos(2 * np.pi * u).sum(axis=0)

    family = CellFamily(name="own", shape=shape)
    _, data = scene_in(family._repr_html_())
    assert data["title"] == "own, relative density 0.3"
    np.testing.assert_allclose(data["box"], [[0, 0, 0], [2, 2, 2]], atol=1e-3)
    assert scene_in(calibrate(family)._repr_html_())[1] == data
    broken = CellFamily(name="broken", shape=lambda u: u[0])
    assert broken._repr_html_().startswith("<p>cell &#x27;broken&#x27;: values change by 1")


def test_fields_and_tetrahedra_show_their_surface():
    surface = box_surface((2.0, 3.0, 5.0))
    x = surface.vertices.T
    fields = SurfaceFields(surface=surface, von_mises=7.0 * x[0], displacement=0.01 * x)
    _, data = scene_in(fields._repr_html_())
    assert [view["title"] for view in data["views"]] == ["Stress", "Displacement", "Surface"]
    assert data["analysed"]["cases"][0]["most"] == 14.0
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).T
    mesh = TetMesh(points=corners, tets=np.array([[0, 1, 2, 3]]).T)
    page, _ = scene_in(mesh._repr_html_())
    assert "4 triangles, 1 x 1 x 1" in page


def test_texts_stay_on_one_screen():
    case, part = load_case(CASES / "bracket"), load_part(CASES / "bracket")
    records = [case, part, part.surface, CellFamily(name="own", shape=np.sum)]
    for record in records:
        lines = repr(record).splitlines()
        assert len(lines) <= 24
        assert max(map(len, lines)) <= 200
    assert "surface=<SurfaceMesh>" in repr(part)
    assert repr(box_surface((1.0, 1.0, 1.0))) == (
        "<SurfaceMesh\n  vertices=<array (8, 3) float64>\n  faces=<array (12, 3) int64>>"
    )


def test_a_result_is_rows_of_a_table(tmp_path):
    pytest.importorskip("pandas")
    result = result_of(tmp_path)
    (row,) = result.to_frame().to_dict("records")
    assert (row["name"], row["low"], row["decisive"], row["passed"]) == (
        "displacement of tip", 0.048, 0.055, True,
    )  # fmt: skip
    assert row["utilisation"] == pytest.approx(0.055 / 0.062)
    (row,) = result.to_frame("iterations").to_dict("records")
    assert (row["number"], row["displacement of tip (shear), explicit"]) == (1, 0.05)
    assert len(replace(result, solid=result.limits).to_frame("solid")) == 1
    with pytest.raises(CaseError, match="rows is 'weights'; expected one of limits, solid"):
        result.to_frame("weights")


def test_a_property_table_is_rows_by_density(small_table):
    pytest.importorskip("pandas")
    frame = small_table.to_frame()
    # Isotropic: E and nu as they went in, G = E / 2 / (1 + nu).
    np.testing.assert_allclose(frame["E_x"], [0.1, 0.4])
    np.testing.assert_allclose(frame["nu_xy"], 0.25)
    np.testing.assert_allclose(frame["G_xy"], frame["E_z"] / 2.5)
    assert frame["cell"].tolist() == ["own", "own"]


@pytest.fixture
def small_table():
    from gradedesign.mechanics.material.scaling_law import isotropic_stiffness

    stiffness = np.moveaxis(isotropic_stiffness(np.array([0.1, 0.4]), 0.25), -1, 0)
    return gradedesign.PropertyTable(
        name="own-computed", family="own", parameters={}, symmetry="cubic", poissons_ratio=0.3,
        density=[0.2, 0.5], stiffness=stiffness, stiffness_error=[0.01, 0.01],
        strength=[0.1, 0.3], strength_error=[0.0, 0.0], resolution=[64, 64], percentile=99.5,
        method="by hand", version="0", date="2026-01-01",
    )  # fmt: skip


def test_without_pandas_a_sentence_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(CaseError, match="pandas, which is not installed: pip install 'gradedesi"):
        result_of(tmp_path).to_frame()


def test_a_record_that_is_shown_loads_nothing_before_it_is():
    code = (
        "import sys, gradedesign\n"
        "print(*sorted(set(sys.modules) & {'gradedesign.program.commands.notebook', 'numpy', "
        "'pandas', 'inspect'}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == []


def test_the_page_of_the_docs_runs_as_it_is():
    """But for its first block, whose run takes a minute; what that shows is tested above."""
    pytest.importorskip("pandas")
    text = (CASES.parent / "docs" / "notebook.md").read_text("utf-8")
    first, cell, table = re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    assert "load_part(" in first
    scope = {}
    body, _, last = cell.rstrip().rpartition("\n")
    exec(body, scope)
    assert scene_in(eval(last, scope)._repr_html_())
    body, _, last = table.rstrip().rpartition("\n")
    exec(body, scope)
    frame = eval(last, scope)
    assert (np.diff(frame["E_x"]) > 0).all()


NOTEBOOKS = {
    path.stem: json.loads(path.read_text("utf-8"))
    for path in sorted((CASES.parent / "docs" / "notebooks").glob("*.ipynb"))
}


def outputs(executed):
    """Words and numbers that the cells of a notebook show, whether as text or beside a picture."""
    shown = []
    for cell in executed["cells"]:
        for output in cell.get("outputs", ()):
            text = "".join(output.get("text") or output["data"]["text/plain"])
            kinds = sorted(output.get("data", ()))
            numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*", text)]
            shown.append((kinds, re.sub(r"-?\d+\.?\d*", "N", text).split(), numbers))
    return shown


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name == "case-to-verdict" else ())
        for name in NOTEBOOKS
    ],
)
def test_notebooks_show_what_they_showed(name):
    """Numbers within 1 %: meshes differ a little between machines."""
    pytest.importorskip("pandas")
    place = CASES.parent / "docs" / "run_notebooks.py"
    spec = spec_from_file_location("run_notebooks", place)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    stored, now = outputs(NOTEBOOKS[name]), outputs(module.executed(NOTEBOOKS[name]))
    assert stored
    assert [(kinds, words) for kinds, words, _ in now] == [(k, words) for k, words, _ in stored]
    for (_, _, before), (_, _, after) in zip(stored, now, strict=True):
        assert after == pytest.approx(before, rel=0.01, abs=2e-3)


def test_notebooks_are_small_and_numbered_in_order():
    assert set(NOTEBOOKS) == {"case-to-verdict", "own-cell", "homogenise-and-choose"}
    for stored in NOTEBOOKS.values():
        assert len(json.dumps(stored)) < 800_000
        counts = [c["execution_count"] for c in stored["cells"] if c["cell_type"] == "code"]
        assert counts == list(range(1, len(counts) + 1))
