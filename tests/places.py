"""Folders of the repository that tests read from, and what its files say."""

from __future__ import annotations

import ast
import functools
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS, MESHES, STUDIES = ROOT / "docs", ROOT / "meshes", ROOT / "studies"


@functools.cache
def parsed(path: Path) -> ast.Module:
    """Return the syntax tree of a file, which several tests walk through."""
    return ast.parse(path.read_text(encoding="utf-8"))
