"""Folders of the repository that tests read from."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS, MESHES, STUDIES = ROOT / "docs", ROOT / "meshes", ROOT / "studies"
