"""``fingerslip sensitivity``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from fingerslip.study.inspection import sensitivity
from fingerslip.tables.table import Column, Table


def test_what_is_asked_for_is_passed_on_and_printed(
    invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []
    table = Table("What moves it", (Column("value"),), (("friction",),))
    monkeypatch.setattr(sensitivity, "write_sensitivities", lambda *own: asked.append(own) or (table,))
    output = invoke("sensitivity", "results/x", "--of", "overall_slip", "--method", "morris").output
    assert "What moves" in output
    assert [str(one) for one in asked[0]] == ["results/x", "overall_slip", "morris"]  # type: ignore[union-attr]
