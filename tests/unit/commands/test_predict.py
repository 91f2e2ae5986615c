"""``fingerslip predict``."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from fingerslip.study.inspection import sensitivity
from fingerslip.tables.table import Column, Table


def test_values_and_outputs_are_passed_on(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    table = Table("Predicted", (Column("output"),), (("latency",),))
    monkeypatch.setattr(sensitivity, "predict_table", lambda *own: asked.append(own) or table)
    printed = invoke("predict", "results/x", "--at", "a.b=1", "--at", "c=2 mm", "--json").output
    assert json.loads(printed)[0]["rows"] == [["latency"]]
    assert asked[0][1:] == (["a.b=1", "c=2 mm"], ["incipient_slip", "overall_slip", "latency"])
