"""The study of a block that is run, damaged and interrupted."""

from pathlib import Path
from typing import Any

import yaml

from fingerslip.mesh.io import write_mesh
from unit.study.block import block_mesh, block_values

TWO_RUNS: dict[str, Any] = {"sweep": {"contact.friction_coefficient": [0.2, 0.6]}}


def write_block(folder: Path, **changes: Any) -> Path:
    """Write a study of a block with some of its values changed, and its mesh, and return its path."""
    write_mesh(block_mesh(), folder / "block.msh")
    path = folder / "block.yaml"
    path.write_text(yaml.safe_dump(block_values() | changes, sort_keys=False))
    return path
