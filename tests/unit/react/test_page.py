"""The code of the page on reactions runs as it is printed."""

from __future__ import annotations

from pathlib import Path

import pytest

from places import DOCS
from unit.test_howto import run_page


@pytest.mark.slow
def test_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_page(DOCS / "reaction.md", tmp_path, monkeypatch)
