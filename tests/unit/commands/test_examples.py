"""``fingerslip examples``: the studies that ship."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_examples_are_listed_and_copied(invoke: Callable[..., Any]) -> None:
    assert "wang2014_table2" in invoke("examples").output
    assert invoke("examples", "wang2014_table2").output.strip() == "wang2014_table2.yaml"
    assert Path("wang2014_table2.yaml").is_file()
