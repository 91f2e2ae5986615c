"""``fingerslip mesh``: the mesh of a study in a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_mesh_of_a_study_is_written(invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path) -> None:
    from fingerslip.mesh.io import read_mesh

    result = invoke("mesh", block(), "-o", "copy.msh")
    assert result.exit_code == 0
    assert "45 nodes, 32 cells" in result.output
    assert set(read_mesh(tmp_path / "copy.msh").boundaries) == {"bottom", "top"}
