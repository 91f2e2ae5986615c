"""``fingerslip view``: a picture of a stored run, without a display."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingerslip.history import write_history
from unit.report.scenes import block_history


def test_options_reach_the_picture_and_its_path_is_printed(invoke: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    write_history(block_history(), tmp_path / "run" / "history.nc")
    done = invoke("view", "run", "--screenshot", "p.png", "--scalar", "region", "--time", "50 ms")
    assert done.exit_code == 0, done.stderr
    assert done.stdout == "p.png\n"
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    wrong = invoke("view", "run", "--screenshot", "q.png", "--cut", "w")
    assert wrong.exit_code == 2
    assert "view: cut: got 'w', needs 'none', 'x', 'y' or 'z'" in wrong.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_where_nothing_can_be_shown_one_line_says_so(
    invoke: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_history(block_history(), tmp_path / "history.nc")
    monkeypatch.setenv("DISPLAY", "")
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        tried = {
            ("--web", "--no-browser", "--port", port): f"port {port} is in use at 127.0.0.1, needs a port that is free",
            ("--web", "--no-browser", "--port", 70000): "view: --port: got 70000, needs a number from 0 to 65535",
            ("--web", "--no-browser", "--host", "192.0.2.1"): "view: --host: '192.0.2.1' is no address of this machine",
            (): "view: found no display to open a window on, needs one that answers; write --web for a browser",
        }
        for options, words in tried.items():
            done = invoke("view", "history.nc", *options)
            assert done.exit_code == 2
            assert words in done.stderr
            assert (done.stdout, done.stderr.count("\n")) == ("", 1)
