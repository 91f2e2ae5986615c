"""Ways to draw where there is no display."""

from __future__ import annotations

import socket

import pytest

from fingerslip.errors import ResultError
from fingerslip.report.scene import viewer as rendering


@pytest.fixture(autouse=True)
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave neither a display nor an earlier choice."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setattr(rendering.sys, "platform", "linux")
    rendering._working_window.cache_clear()


def test_the_first_way_that_draws_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendering, "_draws", lambda window: window == "vtkOSOpenGLRenderWindow")
    rendering.prepare_rendering()
    assert rendering.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_where_nothing_draws_one_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendering, "_draws", lambda _: False)
    with pytest.raises(ResultError, match=r"libegl1.*ParaView"):
        rendering.prepare_rendering()


def test_with_a_display_nothing_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(rendering, "_connects", lambda *_: True)
    monkeypatch.setattr(rendering, "_draws", lambda _: pytest.fail("tried"))
    rendering.prepare_rendering()
    assert rendering.has_display()


def test_a_way_that_ends_the_process_does_not_draw() -> None:
    assert not rendering._draws("vtkNoSuchWindow") or rendering._draws("vtkEGLRenderWindow")


@pytest.mark.parametrize("display", ["", ":9876", "localhost:3456.0", "unix:9876", "no display", "wayland-0", ":99999"])
def test_a_display_that_does_not_answer_is_none(display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", display)
    assert not rendering.has_display()


def test_a_display_that_answers_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setattr(rendering, "_X_PORT", server.getsockname()[1] - 10)
        monkeypatch.setenv("DISPLAY", "localhost:10.0")
        assert rendering.has_display()
