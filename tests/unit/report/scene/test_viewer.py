"""Pictures, films, windows and pages in a browser, drawn without a display."""

import contextlib
import queue
import shutil
import socket
import subprocess
import sys

import numpy as np
import pytest
import pyvista
from PIL import Image

import fingerslip as fs
from fingerslip.report.colours import REGION_COLOURS
from fingerslip.report.scene import viewer, web
from fingerslip.report.scene.options import LOCAL, SceneOptions, Served
from fingerslip.report.scene.web import serve
from unit.report.figures.made import panels
from unit.report.scenes import block_history

INCIPIENT = fs.Events(slip=fs.SlipEvents(incipient=0.06))


@pytest.fixture(scope="module")
def history():
    return block_history()


@pytest.mark.slow
def test_a_picture_shows_something_and_changes_with_what_is_shown(history):
    size = (160, 120)
    whole = viewer.still(history, options=SceneOptions(scalar="region"), size=size)
    assert whole.shape == (120, 160, 3)
    assert whole.std() > 5.0
    assert (whole[0, -1] == 255).all()  # a white ground
    field, early = viewer.still(history, size=size), viewer.still(history, 0.0, size=size)
    assert np.abs(whole.astype(int) - field).max() > 50
    assert np.abs(early.astype(int) - field).max() > 50


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, ["FA-II"]),
        ({"contact": True, "receptors": False}, ["stick", "slip"]),
        ({"scalar": "region"}, ["skin", "tissue", "FA-II"]),
        ({"written": False, "contact": True}, []),
    ],
)
def test_a_picture_says_what_its_colours_stand_for_and_has_a_scale(history, options, expected, monkeypatch):
    written, bars = [], []
    add_text, add_labels = pyvista.Plotter.add_text, pyvista.Plotter.add_point_labels

    def keep_text(self, text, *others, **look):
        written.append((text, look.get("name", "")))
        assert look.get("color") not in set(REGION_COLOURS.values()), "too pale for letters"
        return add_text(self, text, *others, **look)

    def keep_label(self, points, labels, **look):
        bars.extend(labels)
        return add_labels(self, points, labels, **look)

    monkeypatch.setattr(pyvista.Plotter, "add_text", keep_text)
    monkeypatch.setattr(pyvista.Plotter, "add_point_labels", keep_label)
    viewer.still(history, options=SceneOptions(**options), size=(160, 120))
    assert [text for text, name in written if name.startswith("name ")] == expected
    assert bars == ["2 mm"]


@pytest.mark.slow
def test_pictures_and_films_are_files_written_whole(history, tmp_path, monkeypatch):
    viewer.save_still(history, tmp_path / "block.png", 0.05)
    with Image.open(tmp_path / "block.png") as picture:
        assert picture.size == (1200, 900)
    whole = viewer.stills
    monkeypatch.setattr(viewer, "stills", lambda *asked: whole(*asked[:3], (160, 120)))
    viewer.save_movie(history, tmp_path / "block.gif", SceneOptions(cut="y"))
    with Image.open(tmp_path / "block.gif") as film:
        assert film.n_frames == history.sizes["snapshot_time"]
    with pytest.raises(fs.ResultError, match="cannot be written"):
        viewer.save_still(history, tmp_path / "nowhere" / "block.png")
    for save in (viewer.save_still, viewer.save_movie):
        with pytest.raises(fs.InputError, match=r"ends in '\.bmp', needs one of"):
            save(history, tmp_path / "other.bmp")
        with pytest.raises(fs.ResultError, match="snapshots_every"):
            save(history.drop_dims("snapshot_time"), tmp_path / "other.webp")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["block.gif", "block.png"]


@pytest.fixture
def control(history):
    plotter = pyvista.Plotter(off_screen=True)
    yield viewer.SceneControl(plotter, history, SceneOptions(), 0.0)
    plotter.close()


def press(control, box, state):
    boxes = control.plotter.widgets.button_widgets
    boxes[box].GetRepresentation().SetState(state)
    boxes[box].InvokeEvent("StateChangedEvent")


def test_what_is_shown_follows_the_choices(control):
    control.choose(scalar="displacement")
    assert list(control.plotter.scalar_bars.keys()) == ["displacement [mm]"]
    control.choose(scalar="region")
    assert list(control.plotter.scalar_bars.keys()) == []
    control.show(0.1)
    control.choose(plate=False, contact=True, receptors=False)
    names = set(control.plotter.actors)
    assert names & {"contact 1", "contact 2"}
    assert not names & {"plate 0", "arrow 0", "sites FA-II"}
    control.choose(contact=False, camera="side")
    assert not {"contact 1", "contact 2"} & set(control.plotter.actors)
    control.toggle("skin", False)
    control.toggle("tissue", False)
    assert control.options.hidden == ("skin",), "the last layer stays"


def test_boxes_and_the_slider_show_and_hide(control):
    control.show(1.0)
    viewer._add_controls(control, INCIPIENT)
    plotter = control.plotter
    (slider,) = plotter.widgets.slider_widgets
    assert len(plotter.widgets.button_widgets) == 5
    assert "event incipient" in plotter.actors
    press(control, 2, 0)
    press(control, 4, 1)
    assert "plate 0" not in plotter.actors
    assert {"contact 1", "contact 2"} & set(plotter.actors)
    press(control, 0, 0)
    assert "layer skin" not in plotter.actors
    slider.GetRepresentation().SetValue(0.0)
    slider.InvokeEvent("EndInteractionEvent")
    assert "layer skin" not in plotter.actors
    assert plotter.actors["layer tissue"].bounds[5] == pytest.approx(10.0)
    press(control, 0, 1)
    assert "layer skin" in plotter.actors
    for _ in range(2):
        viewer._draw_picked_node(control, (5.0, 5.0, 0.0))
    assert len(plotter.renderer._charts) == 1
    assert [viewer._next(("a", "b"), name) for name in ("a", "b")] == ["b", "a"]


def test_the_nearest_node_is_that_of_the_deformed_body_and_has_its_displacement_and_stress(history):
    last = history.sizes["snapshot_time"] - 1
    moved = history["node_position"].values + history["snapshot_displacement"].values[last]
    assert viewer.nearest_node(history, last, 1e3 * moved[7] + 1e-3) == 7
    flat = block_history("Q4")
    assert viewer.nearest_node(flat, 0, np.array([*1e3 * flat["node_position"].values[3], 0.0])) == 3
    figure = viewer.picked_figure(history, 7, INCIPIENT)
    above, below = panels(figure)
    drawn = [line for line in above.lines if line.get_label() in "xyz"]
    moved = 1e3 * history["snapshot_displacement"].values[:, 7]
    np.testing.assert_allclose(np.stack([line.get_ydata() for line in drawn], axis=1), moved)
    assert below.lines[0].get_ydata().max() > 0.0
    assert figure.get_suptitle().startswith("Node 7 at (")
    assert [kind for kind, _ in viewer.receptor_legend(history)] == ["FA-II"], "the recorded receptors only"


@pytest.fixture
def bare(monkeypatch):
    """Leave neither a display nor an earlier choice."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setattr(viewer.sys, "platform", "linux")
    return monkeypatch


def test_the_first_way_that_draws_is_taken_and_with_a_display_nothing_is_tried(bare):
    bare.setattr(viewer, "_draws", lambda _: False)
    with pytest.raises(fs.ResultError, match=r"libegl1.*ParaView"):
        viewer.prepare_rendering()
    bare.setattr(viewer, "_draws", lambda window: window == "vtkOSOpenGLRenderWindow")
    viewer.prepare_rendering()
    assert viewer.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"
    assert not viewer._draws("vtkNoSuchWindow") or viewer._draws("vtkEGLRenderWindow")
    bare.setenv("DISPLAY", ":0")
    bare.setattr(viewer, "_connects", lambda *_: True)
    bare.setattr(viewer, "_draws", lambda _: pytest.fail("tried"))
    viewer.prepare_rendering()
    assert viewer.has_display()


@pytest.mark.parametrize("display", ["", ":9876", "localhost:3456.0", "unix:9876", "no display", "wayland-0", ":99999"])
def test_a_display_that_does_not_answer_is_none_and_one_that_does_is_one(display, bare):
    bare.setenv("DISPLAY", display)
    assert not viewer.has_display()
    with socket.create_server(("127.0.0.1", 0)) as server:
        bare.setattr(viewer, "_X_PORT", server.getsockname()[1] - 10)
        bare.setenv("DISPLAY", "localhost:10.0")
        assert viewer.has_display()


CHROMIUM = shutil.which("chromium")


def test_without_a_display_trame_or_snapshots_no_window_opens_and_nothing_is_served(history, monkeypatch):
    monkeypatch.setattr(viewer, "has_display", lambda: False)
    with pytest.raises(fs.InputError, match="--screenshot"):
        viewer.open_window(history, SceneOptions(), "t", fs.Events())
    monkeypatch.setitem(sys.modules, "trame.app", None)
    with pytest.raises(fs.ResultError, match=r"pip install 'fingerslip\[web\]'"):
        web._server()
    history = block_history("Q4").drop_dims("snapshot_time")
    with pytest.raises(fs.ResultError, match="snapshots_every"):
        serve(history, fs.Events(), SceneOptions(), "t", Served(opened=False))


@pytest.mark.parametrize("opened", [True, False])
def test_a_browser_is_opened_where_that_is_wanted_and_nothing_but_the_address_is_said(opened, monkeypatch, capfd):
    asked = queue.Queue()
    monkeypatch.setattr(web.webbrowser, "open", asked.put)
    said = []
    web._show(Served(announce=said.append, opened=opened), "http://127.0.0.1:1/")
    assert said == ["http://127.0.0.1:1/"]
    if opened:
        assert asked.get(timeout=10) == said[0]
    assert asked.empty()
    assert capfd.readouterr().out == ""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Serve a block from a process of its own, as the command does."""
    folder = tmp_path_factory.mktemp("run")
    fs.write_history(block_history(), folder / "history.nc")
    command = [sys.executable, "-m", "fingerslip", "view", str(folder / "history.nc"), "--web", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:
        assert served.stdout is not None
        yield served.stdout.readline().strip().removeprefix("open ")
        served.terminate()


@pytest.fixture(scope="module")
def page(address):
    with pytest.importorskip("playwright.sync_api").sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        opened = browser.new_page(viewport={"width": 1300, "height": 850})
        said = []
        asked = set()
        opened.on("pageerror", lambda error: said.append(str(error)))
        opened.on("request", lambda request: asked.add(request.url.split("/")[2].split(":")[0]))
        opened.goto(address)
        opened.wait_for_selector("#slider, .v-slider", timeout=60_000)
        opened.wait_for_timeout(4000)
        yield opened
        assert said == []
        assert asked <= {LOCAL, ""}
        browser.close()


def _picture(page):
    page.wait_for_timeout(1500)
    return bytes(page.screenshot(clip={"x": 320, "y": 80, "width": 900, "height": 560}))


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_browser_shows_fields_time_contact_and_a_picked_node(page, address):
    with contextlib.closing(socket.create_connection((LOCAL, int(address.rstrip("/").rpartition(":")[2])))):
        pass
    seen = [_picture(page)]
    page.get_by_label("contact").check()
    assert "stick" in page.locator("#legend").inner_text()
    page.get_by_label("skin").uncheck()
    seen.append(_picture(page))
    page.locator(".v-slider [role=slider]").focus()
    before = page.locator("#moment").inner_text()
    page.keyboard.press("ArrowLeft")
    seen.append(_picture(page))
    assert page.locator("#moment").inner_text() != before
    page.get_by_role("combobox").first.click(force=True)
    page.get_by_text("displacement [mm]").last.click()
    seen.append(_picture(page))
    assert len(set(seen)) == len(seen), "each choice changes the picture"
    assert "slide starts" in page.locator("#events").inner_text()
    page.mouse.click(760, 330)
    page.wait_for_selector("#picked", timeout=20_000)
