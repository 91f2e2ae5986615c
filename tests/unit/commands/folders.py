"""What lies in a folder, for tests that hold that nothing was written."""

from __future__ import annotations

from pathlib import Path


def contents(folder: Path) -> list[str]:
    """Return the relative paths of all files and folders below a folder, sorted."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))
