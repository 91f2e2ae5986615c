"""``fingerslip export``: results for other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.usefixtures("no_report")
def test_export_says_where_it_wrote(invoke: Callable[..., Any], block: Callable[..., Path]) -> None:
    invoke("run", "--workers", "1", block())
    result = invoke("export", "results/block", "--format", "mat")
    assert result.exit_code == 0
    assert Path(result.output.strip()).joinpath("runs.mat").is_file()
    assert invoke("export", "results/block", "--format", "xls").exit_code == 2
