"""``fingerslip examples``: the studies that ship."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingerslip.study.running.plan import plan_study
from places import ROOT


def test_examples_are_listed_and_copied(invoke: Callable[..., Any]) -> None:
    assert "wang2014_table2" in invoke("examples").output
    assert invoke("examples", "wang2014_table2").output.strip() == "wang2014_table2.yaml"
    assert Path("wang2014_table2.yaml").is_file()


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "studies").glob("*.yaml")))
def test_every_copy_is_read_in_an_empty_folder(invoke: Callable[..., Any], name: str) -> None:
    copied = invoke("examples", name).output.split()
    assert f"{name}.yaml" in copied
    assert plan_study(Path(f"{name}.yaml")).runs
