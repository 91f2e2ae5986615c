"""``fingerslip schema``: what study files may hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any


def test_schema_is_json(invoke: Callable[..., Any]) -> None:
    assert json.loads(invoke("schema").output)["title"] == "Study"
