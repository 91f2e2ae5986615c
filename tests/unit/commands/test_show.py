"""``fingerslip show``: values with their sources."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_show_puts_assumed_values_first(invoke: Callable[..., Any]) -> None:
    lines = invoke("show", "wang2014-2d").output.splitlines()
    named = re.findall(r"^ *[a-z_.]+ +\S.*? +(assumed|wang2014|corniani2024) ", "\n".join(lines), re.MULTILINE)
    assert len(named) > 40
    assert named[0] == "assumed"
    assert "assumed" not in named[named.index("wang2014") :]


def test_show_lists_presets(invoke: Callable[..., Any]) -> None:
    assert "wang2014-2d" in invoke("show").output


def test_show_study_says_what_is_swept_and_what_is_default(
    invoke: Callable[..., Any], block: Callable[..., Path]
) -> None:
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    output = invoke("show", path).output
    for name, value, source in (
        ("contact.friction_coefficient", "0.2, 0.4", "study file, swept"),
        ("time.step", "2 ms", "study file"),
        ("integration", "selective", "default"),
    ):
        assert re.search(rf"^ *{re.escape(name)} +{value} +{source} *$", output, re.MULTILINE), name
