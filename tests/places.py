"""Folders of the repository that tests read from, and what its files say."""

from __future__ import annotations

import ast
import functools
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[1]
DOCS, MESHES, STUDIES = ROOT / "docs", ROOT / "meshes", ROOT / "studies"


@functools.cache
def parsed(path: Path) -> ast.Module:
    """Return the syntax tree of a file, which several tests walk through."""
    return ast.parse(path.read_text(encoding="utf-8"))


def run_page(path: Path) -> dict[str, Any]:
    """Run the Python of a page from top to bottom, and return the names that it leaves."""
    blocks = re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks, "a page has code"
    # Dataclasses look their module up.
    module = sys.modules["page"] = ModuleType("page")
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"{path.name}, block {number}", "exec", dont_inherit=True), vars(module))
    return vars(module)
