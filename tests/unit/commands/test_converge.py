"""``fingerslip converge``: error bars beside the events."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.usefixtures("no_report")
def test_converge_gives_the_events_their_uncertainty(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path
) -> None:
    study = block(curvature=2.0)
    found = invoke("converge", study, "--results", tmp_path / "r", "--workers", "1")
    assert found.exit_code == 0, found.stderr
    assert "Numerical uncertainty, run" in found.stdout
    assert "overall slip (accumulated slip)" in found.stdout
    again = invoke("converge", study, "--results", tmp_path / "r", "--markdown")
    assert again.stdout.startswith("## Numerical uncertainty, run")
    assert "computed" not in again.stderr
    shown = invoke("show", tmp_path / "r" / "block")
    assert "After ±" in shown.stdout
