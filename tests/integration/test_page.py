"""Report pages in a browser: no errors, accessible, usable offline, on a phone and by keyboard."""

import dataclasses
import itertools
import re
import shutil

import pytest
from matplotlib.path import Path as Outline

from fingerslip.history import phase_times
from fingerslip.published import published_set
from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.page import write_page
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import result_of
from unit.report.page.contents import content_of
from unit.report.scenes import block_history

CHROMIUM = shutil.which("chromium")
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")]


def content(history):
    names = {"0.4": 0.4, "0.6": 0.6, "0.8": 0.8}
    runs = tuple(result_of(history, name, {"contact.friction_coefficient": mu}) for name, mu in names.items())
    values = (ShownValue("fingertip.depth", "1 mm", "assumed", "scales all forces"),)
    made = content_of(
        runs,
        dict.fromkeys(names, history),
        references=(published_set("wang2014-table2"),),
        values=values,
        provenance={"commit": "abc"},
        starts=dict.fromkeys(names, phase_times(history, "slide")[0][0]),
        notes="<h3>Mine</h3><p>A note.</p>",
    )
    return dataclasses.replace(made, study=dataclasses.replace(made.study, description="When does it slip?"))


@pytest.fixture(scope="module", params=["Q4", "T10"])
def page_file(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "report.html"
    write_page(study_report(content(block_history(request.param))), file)
    return file


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


# Notes the corners of every word that is drawn in the plots since the canvas was last cleared.
WORDS = """
window.drawn = [];
const canvas = CanvasRenderingContext2D.prototype, [clear, write] = [canvas.clearRect, canvas.fillText];
canvas.clearRect = function (...box) {
  if (this.canvas.dataset.part === "plots") window.drawn = [];
  clear.apply(this, box);
};
canvas.fillText = function (text, x, y) {
  write.call(this, text, x, y);
  if (this.canvas.dataset.part !== "plots") return;
  const own = this.measureText(text), to = this.getTransform(), ratio = window.devicePixelRatio;
  const [left, right] = [x - own.actualBoundingBoxLeft, x + own.actualBoundingBoxRight];
  const [top, bottom] = [y - own.actualBoundingBoxAscent, y + own.actualBoundingBoxDescent];
  const corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
  const at = corners.map(([a, b]) => new DOMPoint(a, b).matrixTransform(to)).map((p) => [p.x / ratio, p.y / ratio]);
  window.drawn.push({ text, at });
};
"""


@pytest.fixture(params=[1400, 390])
def page(request, browser, page_file):
    context = browser.new_context(viewport={"width": request.param, "height": 900}, offline=True)
    opened = context.new_page()
    said = []
    opened.on("console", lambda message: said.append(message.text))
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("requestfailed", lambda asked: said.append(asked.url))
    opened.add_init_script(WORDS)
    opened.goto(page_file.as_uri())
    opened.wait_for_selector(".motion[data-ready]", timeout=60_000)
    yield opened
    assert said == []
    context.close()


def _pixels(page):
    return str(page.locator("[data-part=body]").evaluate("canvas => canvas.toDataURL()"))


def test_page_is_accessible_its_words_are_apart_and_its_tables_in_sight(page):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.locator("main h2").count() > 5
    assert page.locator("img:not([alt])").count() == 0
    words = page.evaluate("window.drawn")
    width = page.locator("[data-part=plots]").evaluate("canvas => canvas.clientWidth")
    assert {"normal", "tangential", "tangential / normal force", "has slipped by more than 20 \N{MICRO SIGN}m"} <= {
        word["text"] for word in words
    }
    shapes = [Outline([*word["at"], word["at"][0]]) for word in words]
    for word, shape in zip(words, shapes, strict=True):
        assert shape.vertices[:, 0].min() >= 0.0, word
        assert shape.vertices[:, 0].max() <= width, word
    pairs = itertools.combinations(zip(words, shapes, strict=True), 2)
    found = [(one["text"], two["text"]) for (one, first), (two, second) in pairs if first.intersects_path(second)]
    assert found == []
    hidden = "table => table.scrollWidth > table.clientWidth + 1"
    for caption in ("Slip events from", "What was run"):
        for table in page.locator(".table", has=page.locator("caption", has_text=caption)).all():
            assert not table.evaluate(hidden), "no column is covered or out of sight"
    page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    cells = page.locator("tr > :nth-last-child(-n+2)", has_text=re.compile(r"^(overall|latency) \["))
    assert cells.count() >= 6
    for cell in cells.all():
        box, around = cell.bounding_box(), cell.locator("xpath=ancestor::div").bounding_box()
        assert around["x"] <= box["x"]
        assert box["x"] + box["width"] <= around["x"] + around["width"] + 1


def test_a_picture_that_is_smaller_than_it_is_can_be_seen_whole_and_small_again(page):
    picture = page.locator("figure img[role=button]").first
    picture.focus()
    width = picture.evaluate("image => image.clientWidth")
    page.keyboard.press("Enter")
    assert picture.evaluate("image => image.clientWidth === image.naturalWidth")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), "it scrolls in its own place"
    picture.click()
    assert picture.evaluate("image => image.clientWidth") == width


def test_tables_sort_both_ways_and_print_opens_what_is_folded(page):
    table = page.locator("table[data-sortable]").first
    first = table.locator("tbody tr").first.locator("td").first
    button = table.locator("thead button").first
    button.click()
    assert first.inner_text() == "0.4"
    button.click()
    assert first.inner_text() == "0.8"
    assert table.locator("th").first.get_attribute("aria-sort") == "descending"
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.locator("details:not([open])").count() == 0
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.locator("details[open]").count() == 0
    assert len(page.pdf()) > 10_000


# Shares of the body's pixels that are clearly blue as what sticks, and orange as what slips.
STATES = """
async (canvas) => {
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, canvas.width, canvas.height), counts = [0, 0];
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 2] > 1.2 * data[i]) counts[0]++;
    if (data[i + 2] < 0.5 * data[i]) counts[1]++;
  }
  return counts.map((count) => count / (canvas.width * canvas.height));
}
"""


def test_the_contact_of_a_solid_is_seen_from_below_in_its_colours_and_turns(page, page_file):
    keys, bar = page.locator("[data-part=keys]"), page.locator("[data-part=bar]")
    if '"solid":false' in page_file.read_text(encoding="utf-8"):
        assert keys.is_visible()
        assert bar.is_visible()
        return
    assert not keys.is_visible(), "nothing has the colours of stick and slip"
    page.locator("[data-part=field]").select_option("contact")
    assert keys.is_visible()
    assert not bar.is_visible()
    page.locator("[data-part=time]").focus()
    page.keyboard.press("End")
    stick, slip = page.locator("[data-part=body]").evaluate(STATES)
    assert slip > 0.02
    assert stick < 0.001
    canvas, before = page.locator("[data-part=body]"), _pixels(page)
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 60, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 140, box["y"] + 80, steps=4)
    page.mouse.up()
    turned = _pixels(page)
    assert turned != before
    canvas.focus()
    page.keyboard.press("ArrowLeft")
    assert _pixels(page) != turned


def test_slider_and_keys_move_the_run_and_the_time_of_the_body_is_said(page):
    slider, said = page.locator("[data-part=time]"), page.locator("[data-part=said]")
    slider.focus()
    page.keyboard.press("Home")
    assert "body at" not in said.inner_text()
    page.keyboard.press("ArrowRight")
    assert said.inner_text().endswith("body at 0.000 s")
    page.keyboard.press("Home")
    first, pixels = said.inner_text(), _pixels(page)
    page.keyboard.press("End")
    assert said.inner_text() != first
    assert "into the slide" in said.inner_text()
    assert _pixels(page) != pixels
    page.locator("[data-part=run]").select_option("2")
    page.wait_for_timeout(500)
    page.locator("[data-part=field]").select_option("layers")
    assert "skin" in page.locator("[data-part=bar]").inner_text()
