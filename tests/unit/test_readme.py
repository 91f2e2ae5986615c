"""The README's example runs as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def test_python_example_finds_overall_slip(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(example, "README.md", "exec"), names)
    # Once all of the contact slides, friction over normal force is the friction coefficient.
    last = names["history"]["body_force"].values[-1, 0]  # type: ignore[index]
    assert abs(last[0]) == pytest.approx(0.6 * last[1], rel=1e-6)
    assert 1.0 < names["events"].overall < 3.0  # type: ignore[attr-defined]
    assert "overall slip at" in capsys.readouterr().out
