"""Mesh sources: what a source of one's own gets for free, and which class the keys of a file mean."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.mesh.source import MeshFile, MeshSource, choose_source, inspect_mesh, mesh_size_note
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes
from fingerslip.verification.meshes import box

SOURCES = (MeshFile, SurfaceMesh, MeshSizes, SolidSizes)


@parameters
class Block(MeshSource):
    """The least that a source has to say."""

    dim: ClassVar[int] = 2
    element: ClassVar[str] = "Q4"

    size: PositiveLength = 1e-3

    def build(self, _specimen: Any, /) -> skfem.Mesh:
        return box("Q4", *([np.arange(0.0, 4.5e-3, self.size)] * 2))


@dataclass(frozen=True)
class Numbers:
    width: float

    @property
    def shape(self) -> dict[str, float]:
        return {"width": self.width}


@parameters
class FinerBlock(Block):
    """A block whose element size can be refined."""

    element_sizes: ClassVar[tuple[str, ...]] = ("size",)


def test_a_source_of_ones_own_has_answers_for_the_rest() -> None:
    source = Block()
    assert (source.needs_specimen, source.assumes_metres) == (False, False)
    assert source.estimated_cells(None) is None
    assert source.refined(0.5) is None
    assert FinerBlock(2e-3).refined(0.5) == FinerBlock(1e-3)
    assert source.beside(Path("anywhere")) is source
    found = source.inspect(None)
    assert found.mesh.nelements == 16
    assert found.tables[0].rows[0][:2] == ("bulk", 16)


def test_its_key_follows_its_own_values_and_those_of_the_specimen() -> None:
    assert Block().key(Numbers(1.0)) == Block().key(Numbers(1.0))
    assert len({Block(size).key(Numbers(width)) for size in (1e-3, 2e-3) for width in (1.0, 2.0)}) == 4


@pytest.mark.parametrize(
    ("values", "source"),
    [
        ({}, MeshSizes),
        ({"contact_size": "0.1 mm"}, MeshSizes),
        ({"element": "T6"}, MeshSizes),
        ({"element": "T10", "bulk_size": "1 mm"}, SolidSizes),
        ({"element": "H8"}, MeshSizes),
        ({"file": "a.msh"}, MeshFile),
        ({"file": "a.msh", "element": "T4"}, MeshFile),
        ({"skin": "a.stl", "unit": "mm"}, SurfaceMesh),
        ({"tip": [1, 0, 0]}, SurfaceMesh),
    ],
)
def test_the_keys_of_a_file_choose_the_source(values: dict[str, Any], source: type) -> None:
    assert choose_source(SOURCES, values) is source


def test_a_file_that_says_nothing_is_told_what_it_may_say() -> None:
    with pytest.raises(InputError, match="mesh: does not say where the mesh comes from, needs file or skin, tip, pad"):
        choose_source((MeshFile, SurfaceMesh), {})


def test_tables_of_a_mesh_have_a_row_for_each_region() -> None:
    grid = np.linspace(0.0, 1.0, 5)
    mesh = box("T3", grid, grid, regions={"a": lambda c: c[1] < 0.5, "b": lambda c: c[1] > 0.5})
    found = inspect_mesh(mesh)
    (table,) = found.tables
    assert [row[:2] for row in table.rows] == [("a", 16), ("b", 16)]
    assert [row[3] for row in table.rows] == pytest.approx([45.0, 45.0])
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert mesh_size_note(mesh) == "25 nodes, 32 cells; boundaries: left, right, bottom, top"
