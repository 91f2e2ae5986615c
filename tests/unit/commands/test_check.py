"""``fingerslip check``: runs, steps and unknowns, and nothing written."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from unit.commands.folders import contents


def test_check_counts_runs_steps_and_unknowns(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path
) -> None:
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    before = contents(tmp_path)
    result = invoke("check", path)
    assert result.exit_code == 0
    assert "2 runs" in result.output
    # 9 x 5 nodes with two unknowns; 60 ms in steps of 2 ms.
    assert re.search(r"friction_coefficient-0.2 +to do +90 +30 ", result.output)
    assert contents(tmp_path) == before
