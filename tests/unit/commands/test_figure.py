"""``fingerslip figure``: one figure of results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.usefixtures("no_report")
def test_figure_says_where_it_wrote_and_lists_its_kinds(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path
) -> None:
    invoke("run", "--workers", "1", block())
    result = invoke("figure", "results/block", "--kind", "slip-maps", "-o", str(tmp_path / "e.svg"))
    assert result.exit_code == 0, result.output
    assert Path(result.output.strip()).read_bytes().startswith(b"<?xml")
    assert "film: a film, as MP4" in invoke("figure", "results/block").output
    assert invoke("figure", "results/block", "--kind", "x").exit_code == 2
