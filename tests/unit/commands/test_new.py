"""``fingerslip new``: a study file to start from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_a_new_study_can_be_checked(invoke: Callable[..., Any]) -> None:
    result = invoke("new", "friction", "--template", "sweep")
    assert "friction.yaml: look at it with fingerslip check friction.yaml" in " ".join(result.output.split())
    assert Path("friction.yaml").is_file()
    assert invoke("new", "friction").exit_code == 2
