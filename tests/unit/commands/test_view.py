"""``fingerslip view``: a picture of a stored run, without a display."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

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
