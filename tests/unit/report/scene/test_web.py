"""A result in a browser: served to this machine only, fields, time, contact and picked nodes."""

import contextlib
import queue
import shutil
import socket
import subprocess
import sys

import pytest

from fingerslip.errors import ResultError
from fingerslip.history import write_history
from fingerslip.report.scene import web
from fingerslip.report.scene.options import LOCAL, SceneOptions, Served
from fingerslip.report.scene.web import serve
from fingerslip.slip import Events
from unit.report.scenes import block_history

CHROMIUM = shutil.which("chromium")


def test_without_trame_or_snapshots_nothing_is_served(monkeypatch):
    monkeypatch.setitem(sys.modules, "trame.app", None)
    with pytest.raises(ResultError, match=r"pip install 'fingerslip\[web\]'"):
        web._server()
    history = block_history("Q4").drop_dims("snapshot_time")
    with pytest.raises(ResultError, match="snapshots_every"):
        serve(history, Events(), SceneOptions(), "t", Served(opened=False))


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
    write_history(block_history(), folder / "history.nc")
    command = [sys.executable, "-m", "fingerslip", "view", str(folder / "history.nc"), "--web", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:
        assert served.stdout is not None
        yield served.stdout.readline().strip().removeprefix("open ")
        served.terminate()


@pytest.fixture(scope="module")
def page(address):
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as driver:
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
