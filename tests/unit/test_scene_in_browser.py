"""The scene as people see it: in Debian's Chromium, drawn by software."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib.image import imread

from gradedesign import load_case
from gradedesign.design.resolve.shown_case import shown_case
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.part.box import box_surface
from gradedesign.mechanics.explicit.analysis import SurfaceFields
from gradedesign.program.commands.preview import case_preview
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.report import render_report
from gradedesign.program.pictures.case_scene import case_still
from gradedesign.program.pictures.run_scene import RunShown, run_scene

CASES = Path(__file__).parents[2] / "cases"
CHROMIUM = Path("/usr/bin/chromium")
playwright = pytest.importorskip(
    "playwright.sync_api", reason="Playwright's package is not installed: pip install playwright"
)
pytestmark = pytest.mark.skipif(
    not CHROMIUM.exists(), reason=f"no {CHROMIUM}: apt-get install chromium"
)
#: Software drawing, and no request to anywhere.
FLAGS = [
    "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
#: Contrast of every text with what lies behind it, WCAG 2 (relative luminance), least one first.
CONTRASTS = """() => {
  const luminance = (c) => { const [r, g, b] = c.map((v) => v / 255)
    .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
  const behind = (e) => { for (; e; e = e.parentElement) {
    const [r, g, b, a = 1] = numbers(getComputedStyle(e).backgroundColor);
    if (a > 0.85) return [r, g, b]; } return [255, 255, 255]; };
  return [...document.querySelectorAll("body *")]
    .filter((e) => e.offsetParent)
    .filter((e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim()))
    .filter((e) => !e.closest("script, option"))
    .map((e) => { const [a, b] = [numbers(getComputedStyle(e).color).slice(0, 3), behind(e)]
      .map(luminance).sort((p, q) => q - p);
      return [(a + 0.05) / (b + 0.05), `${e.tagName} ${e.textContent.slice(0, 40)}`]; })
    .sort((p, q) => p[0] - q[0]);
}"""
#: Controls that have no name for a screen reader.
NAMELESS = """() => [...document.querySelectorAll("button, select, input, canvas, img")]
  .filter((e) => !(e.getAttribute("aria-label") || e.getAttribute("alt") || e.textContent.trim()
    || [...(e.labels ?? [])].some((l) => l.textContent.trim())))
  .map((e) => e.outerHTML.slice(0, 80))"""


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def bracket(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "bracket.html"
    shown = case_preview(CASES / "bracket", build_registry(), allow_outside=False)
    path.write_text(shown.page(), encoding="utf-8")
    return path


@pytest.fixture
def opened(browser):
    """Open a page at a size; any error on its console fails the test."""
    errors, pages = [], []

    def open_page(path, width, height, before=""):
        page = browser.new_page(viewport={"width": width, "height": height})
        pages.append(page)
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.add_init_script(before)
        page.goto(path.as_uri())
        return page

    yield open_page
    for page in pages:
        page.close()
    assert errors == []


def drawn(page):
    """What the canvas shows once it stands still, without its focus ring, ``(h, w, 3)`` to 255."""
    page.wait_for_selector(".stage.live", timeout=60_000)
    frames = None
    while frames != (frames := page.locator("section.scene").get_attribute("data-drawn")):
        page.wait_for_timeout(250)
    return pixels(page.locator("canvas"))


def changed(first, second):
    """Share of pixels that differ visibly."""
    return float(np.mean(np.abs(first - second).max(axis=2) > 8))


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A report of the bracket with fields that are easy to tell: stress by height, bending."""
    case = shown_case(load_case(CASES / "bracket"), build_registry())
    surface = case.part.surface
    x, _, z = surface.vertices.T
    fields = {
        name: SurfaceFields(
            surface=surface,
            von_mises=stress,
            displacement=1e-4 * np.stack([z**2 / 92, 0 * x, -(x**2) / 112]),
        )
        for name, stress in (("pull", 6.0 * z), ("side", 2.0 * x))
    }
    scene = run_scene(RunShown(case=case, printed=surface, analysed=fields, limit=500.0), "bracket")
    result = RunResult(
        status="met",
        lightest=True,
        reason="every limit holds at the unfavourable end of its band",
        case_name="bracket",
        mass_g=318.4,
        solid_mass_g=768.5,
    )
    path = tmp_path_factory.mktemp("page") / "report.html"
    picture = case_still(case, "Loading")
    path.write_text(render_report(result, {"loads": picture}, "[case]", scene), encoding="utf-8")
    return path


def section_across_y(y):
    """Area of the bracket's section, mm^2, by another library."""
    import manifold3d

    mesh = trimesh.load(CASES / "bracket" / "bracket.stl")
    solid = manifold3d.Manifold(
        manifold3d.Mesh(
            vert_properties=np.array(mesh.vertices, dtype=np.float32),
            tri_verts=np.array(mesh.faces, dtype=np.uint32),
        )
    )
    return solid.rotate((90.0, 0.0, 0.0)).slice(y).area()  # z takes the place of y


def place_of(page, point):
    """Where a point of the part, mm, stands on the page."""
    x, y = page.evaluate(
        """(point) => { const view = window.scenes[0], box = view.canvas.getBoundingClientRect();
          const p = view.middle.clone().set(...point).project(view.camera);
          return [box.x + (p.x + 1) / 2 * box.width, box.y + (1 - p.y) / 2 * box.height]; }""",
        point,
    )
    return x, y


def test_sections_open_when_asked_and_on_paper(opened, report):
    page = opened(report, 1400, 900)
    pre = page.locator("pre")
    assert not pre.is_visible()
    page.locator("summary", has_text="Case file").focus()
    page.keyboard.press("Enter")
    assert pre.is_visible()
    page.keyboard.press("Enter")
    assert not pre.is_visible()
    page.emulate_media(media="print")
    assert pre.is_visible()
    # Nothing is wider than the 180 mm between the margins of A4, in pixels of 1/96 inch.
    page.set_viewport_size({"width": 680, "height": 1000})
    assert page.evaluate("document.documentElement.scrollWidth") <= 680


def test_the_scene_turns_slices_and_picks(opened, bracket):
    page = opened(bracket, 1400, 900)
    first = drawn(page)
    background = first[2, 2]
    # The bracket fills about a fifth of the stage.
    assert 0.08 < np.mean(np.abs(first - background).max(axis=2) > 8) < 0.6

    page.locator("canvas").focus()
    page.keyboard.press("ArrowRight")
    turned = drawn(page)
    assert changed(first, turned) > 0.03
    page.keyboard.press("Home")
    assert changed(first, drawn(page)) < 0.002
    x, y = place_of(page, [56.0, 23.0, 40.0])
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 20, steps=4)
    page.mouse.up()
    assert changed(first, drawn(page)) > 0.03
    page.get_by_role("button", name="Look at an angle").click()
    page.mouse.move(5, 5)
    assert changed(first, drawn(page)) < 0.002

    x, y = place_of(page, [56.0, 0.0, 10.0])  # on the flat side that faces the viewer
    page.mouse.click(x, y)
    region = page.locator(".selector pre").first
    assert 'plane = "y = min"' in region.inner_text()
    assert "(0, -1, 0)" in page.locator(".panel dl").first.inner_text()
    button = page.get_by_role("button", name="Copy the region that finds this face")
    button.click()
    page.wait_for_function("b => b.textContent === 'Copied'", arg=button.element_handle())
    page.locator("canvas").focus()
    page.keyboard.press("Escape")
    assert page.locator(".selector").count() == 0

    page.get_by_label("Face of the part").select_option(label="hole, 12 mm, 753.7 mm²")
    assert 'diameter = "12 mm"' in page.locator(".selector pre").first.inner_text()
    page.get_by_label("Face of the part").select_option("")

    page.get_by_role("combobox", name="Cut").select_option("y")
    page.get_by_label("other side").check()
    page.get_by_label("names").uncheck()
    half = drawn(page)
    page.get_by_label("Place of the cut").fill("0.9")
    less = drawn(page)
    filled = np.count_nonzero(np.abs(half - [0x8D, 0x97, 0xA3]).max(axis=2) < 4)
    # The section as large as it is seen from (1, -1.35, 0.85); arrows and edges cover some of it.
    zoom = page.evaluate("window.scenes[0].camera.zoom")
    seen = section_across_y(23.0) * zoom**2 * 1.35 / np.linalg.norm([1.0, -1.35, 0.85])
    assert filled == pytest.approx(seen, rel=0.04)
    assert changed(half, less) > 0.05
    x, y = place_of(page, [12.0, 41.4, 40.0])  # on the cut: behind it, no face is asked for
    page.mouse.click(x, y)
    assert page.locator(".selector").count() == 0
    page.get_by_role("button", name="Cells").click()
    assert changed(less, drawn(page)) > 0.05

    assert page.evaluate(NAMELESS) == []
    ratio, text = page.evaluate(CONTRASTS)[0]
    assert ratio >= 4.5, text


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (390, 844)])
def test_verdict_and_scene_stand_on_the_first_screen_of_a_report(opened, report, width, height):
    page = opened(report, width, height)
    shown = drawn(page)
    assert np.mean(np.abs(shown - shown[2, 2]).max(axis=2) > 8) > 0.08
    verdict, canvas = (page.locator(each).bounding_box() for each in (".verdict", "canvas"))
    assert 0 <= verdict["y"] < verdict["y"] + verdict["height"] <= canvas["y"]
    assert canvas["y"] + canvas["height"] <= height
    assert canvas["height"] > 250
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.get_by_text("318.4 g of 768.5 g solid").is_visible()
    assert page.evaluate(NAMELESS) == []
    ratio, text = page.evaluate(CONTRASTS)[0]
    assert ratio >= 4.5, text


def test_fields_of_a_run_are_asked_moved_and_printed(opened, report):
    page = opened(report, 1400, 900)
    first = drawn(page)
    page.mouse.move(*place_of(page, [56.0, 0.0, 10.0]))
    page.mouse.wheel(0, 300)  # scrolls the page: nobody has asked for the scene yet
    page.wait_for_function("() => scrollY > 100")
    page.evaluate("scrollTo(0, 0)")
    assert changed(first, drawn(page)) < 0.002
    page.get_by_role("button", name="Stress").click()
    stress = drawn(page)
    assert changed(first, stress) > 0.05
    # Above the limit, from 83.3 mm on, in magenta.
    magenta = (stress[..., 0] > 150) & (stress[..., 1] < 60) & (stress[..., 2] > 120)
    assert 0.001 < magenta.mean() < 0.05
    assert page.get_by_text("above the limit of 500 MPa").is_visible()
    page.mouse.click(*place_of(page, [60.0, 0.0, 11.0]))
    value = page.locator(".panel dd").nth(1).inner_text()
    # The vertex of the triangle that was hit: all of this face lie within 0 to 92 mm.
    assert 0 <= float(value.removesuffix(" MPa")) <= 6 * 92
    page.get_by_label("Load case").select_option("side")
    assert changed(stress, drawn(page)) > 0.03
    page.get_by_role("button", name="Displacement").click()
    still = drawn(page)
    page.get_by_label("Deformation").fill("2")
    assert changed(still, drawn(page)) > 0.03
    # 1.12e-2 mm at the end; 8 % of the diagonal of 152 mm over that is 1087, so 1000, and twice it.
    assert page.get_by_text("× 2000").is_visible()
    page.emulate_media(media="print")
    assert not page.locator("section.scene").is_visible()
    assert page.get_by_role("img", name="loads").is_visible()


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (390, 844)])
def test_title_and_scene_stand_on_the_first_screen(opened, bracket, width, height):
    page = opened(bracket, width, height)
    drawn(page)
    title, canvas = page.locator("h1").bounding_box(), page.locator("canvas").bounding_box()
    assert title["y"] >= 0
    assert canvas["y"] + canvas["height"] <= height
    assert canvas["height"] > 250
    assert canvas["x"] >= 0
    assert canvas["x"] + canvas["width"] <= width
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(CONTRASTS)[0][0] >= 4.5


def test_without_webgl_the_still_picture_stands(opened, bracket):
    page = opened(bracket, 1400, 900, "HTMLCanvasElement.prototype.getContext = () => null;")
    page.wait_for_selector(".scene.without", timeout=30_000)
    still = page.get_by_role("img", name="bracket, picture")
    assert still.is_visible()
    assert page.get_by_text("a still picture stands for the scene").is_visible()
    assert still.evaluate("image => image.naturalWidth") == 1200


def test_a_notebook_turns_the_scene_in_a_frame_of_no_origin(opened, tmp_path):
    """As JupyterLab shows it: the record's HTML in the document of the notebook."""
    path = tmp_path / "cell.html"
    surface = box_surface((2.0, 3.0, 5.0))
    path.write_text(f"<!doctype html><meta charset=utf-8>{surface._repr_html_()}", "utf-8")
    page = opened(path, 1000, 600)
    frame = page.frame_locator("iframe")
    frame.locator(".stage.live").wait_for(timeout=60_000)
    first = pixels(frame.locator("canvas"))
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 10
    frame.get_by_role("button", name="Look along x").click()
    page.wait_for_timeout(500)
    assert changed(first, pixels(frame.locator("canvas"))) > 0.05


def pixels(canvas):
    return np.rint(255 * imread(BytesIO(canvas.screenshot()), format="png")[5:-5, 5:-5, :3])
