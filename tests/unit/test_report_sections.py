"""Sections of a plugin stand in the report of a run, and are blamed on it where they fail."""

import types

import pytest

import gradedesign_cells_tpms
from gradedesign import ReportSection, ReportTable, hookimpl, load_case, run
from gradedesign.errors import PluginError
from gradedesign.program.commands.report import report_again
from gradedesign.program.host.registry import build_registry

CASE = """
[case]
name = "cube"

[part]
box = ["8 mm", "8 mm", "8 mm"]

[lattice]
cell = "gyroid-sheet"
size = "4 mm"
density = 0.3

[output]
formats = ["stl", "report"]
"""


def registry_with(content):
    """The built-in records, gyroids, and a section of a plugin of one's own."""
    own = types.ModuleType("acme_price")

    @hookimpl
    def gradedesign_report_sections():
        yield ReportSection(name="price", title="Price < 9", content=content)

    own.gradedesign_report_sections = gradedesign_report_sections
    return build_registry(plugins=[gradedesign_cells_tpms, own])


def written(folder, content):
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    registry = registry_with(content)
    case = load_case(folder, registry=registry)
    result = run(case, registry, folder=folder / "out")
    return result, (folder / "out" / "report.html").read_text(encoding="utf-8")


def test_a_section_of_a_plugin_is_in_the_report(tmp_path):
    def price(result):
        yield "Of powder <alone>."
        cost = f"{4.0 * result.relative_density:.2f}"
        yield ReportTable(header=("", "EUR"), rows=(("powder", cost),), right=(1,))

    result, page = written(tmp_path, price)
    section = page.partition("<h2>Price &lt; 9</h2>")[2].partition("</details>")[0]
    assert "<p>Of powder &lt;alone&gt;.</p>" in section
    assert f'<td class="n">{4.0 * result.relative_density:.2f}</td>' in section
    assert "<h2>Versions and time</h2>" in page
    # The plugin is not installed: written again, the report has the sections of those that are.
    report_again(tmp_path / "out")
    again = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Price" not in again
    assert "<h2>Versions and time</h2>" in again


def test_a_section_without_content_is_left_out(tmp_path):
    _, page = written(tmp_path, lambda _: ())
    assert "Price" not in page


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (lambda _: [1.0 / 0.0], "report section 'price' of .*acme_price.*division by zero"),
        (lambda _: [7], "of type int, expected str or ReportTable"),
        (lambda _: [ReportTable(header=("a",), rows=(("b", "c"),))], "2 cells, expected 1"),
    ],
)
def test_a_section_that_fails_is_named_with_its_plugin(tmp_path, content, words):
    with pytest.raises(PluginError, match=words):
        written(tmp_path, content)
