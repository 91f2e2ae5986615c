"""``fingerslip diff``: two runs side by side."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.usefixtures("no_report")
def test_diff_shows_what_differs_and_by_how_much(invoke: Callable[..., Any], block: Callable[..., Path]) -> None:
    invoke("run", "--workers", "1", block(sweep={"contact.friction_coefficient": [0.2, 0.4]}))
    result = invoke("diff", *(f"results/block/friction_coefficient-{friction}" for friction in (0.2, 0.4)))
    assert result.exit_code == 0
    assert re.search(r"contact\.friction_coefficient +0\.2 +0\.4", result.output)
    assert re.search(r"friction over normal force at the end of the slide +0\.2 +0\.4 +0\.2", result.output)


def test_diff_of_what_is_no_run(invoke: Callable[..., Any], tmp_path: Path) -> None:
    result = invoke("diff", tmp_path, tmp_path)
    assert result.exit_code == 2
    assert "holds no finished run" in result.stderr
