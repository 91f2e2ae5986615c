"""A mesh file as a source: read with its unit, known by its content."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.io import write_mesh
from fingerslip.mesh.source import MeshFile
from unit.study.block import block_mesh


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "block.msh"
    write_mesh(block_mesh(), path)
    return path


@pytest.mark.parametrize(("unit", "metres"), [(None, 1.0), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)])
def test_coordinates_are_in_the_unit(file: Path, unit: str | None, metres: float) -> None:
    source = MeshFile(str(file), unit)
    assert np.ptp(source.build().p, axis=1) == pytest.approx([10e-3 * metres, 5e-3 * metres])
    assert source.assumes_metres == (unit is None)


def test_only_the_mesh_tells_its_kind_and_size(file: Path) -> None:
    source = MeshFile(str(file))
    assert (source.dim, source.element, source.needs_specimen) == (None, None, False)
    assert source.estimated_cells(None) is None
    assert source.refined(0.5) is None


def test_key_follows_content_and_unit_but_not_the_name(file: Path) -> None:
    first = MeshFile(str(file)).key()
    assert MeshFile(str(file), "mm").key() != first
    copy = file.with_name("copy.msh")
    copy.write_bytes(file.read_bytes())
    assert MeshFile(str(copy)).key() == first
    copy.write_bytes(file.read_bytes() + b" ")
    assert MeshFile(str(copy)).key() != first


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mesh\.file: cannot read .*none\.msh \(No such file"):
        MeshFile(str(tmp_path / "none.msh")).key()


def test_path_is_relative_to_a_folder(file: Path) -> None:
    assert MeshFile("block.msh", "mm").beside(file.parent) == MeshFile(str(file.resolve()), "mm")


def test_inspection_gives_the_quality(file: Path) -> None:
    found = MeshFile(str(file)).inspect(None)
    assert found.suffix == ".msh"
    # Squares of 1.25 mm.
    ((region, cells, jacobian, *_),) = found.tables[0].rows
    assert (region, cells, jacobian) == ("block", 32, pytest.approx(1.0))
