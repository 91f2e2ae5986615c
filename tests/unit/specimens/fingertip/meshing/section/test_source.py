"""Sections as a source of meshes: sizes that fit together, refinement, and the number of cells foreseen."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from unit.fingers import SECTIONS, change


def test_defaults_resolve_the_ridges_and_the_bulk_is_never_finer_than_the_contact():
    sizes = MeshSizes()
    assert sizes.contact_size <= 0.47e-3 / 3
    with pytest.raises(InputError) as caught:
        MeshSizes(contact_size=0.2e-3, bulk_size=0.1e-3)
    assert str(caught.value) == "MeshSizes.bulk_size: got 0.1 mm, needs >= 0.2 mm (contact_size)"
    with pytest.raises(InputError, match="element"):
        MeshSizes(element="T4")


def test_it_says_what_it_is():
    sizes = MeshSizes(element="T3")
    assert (sizes.dim, sizes.element, sizes.needs_specimen, sizes.assumes_metres) == (2, "T3", True, False)
    assert sizes.beside(Path("/anywhere")) is sizes


def test_both_sizes_are_refined():
    finer = MeshSizes(0.12e-3, 0.3e-3, 1e-3, "T6").refined(0.5)
    assert finer == MeshSizes(0.06e-3, 0.15e-3, 1e-3, "T6")


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize(("element", "sizes"), [("Q4", (0.12e-3, 0.28e-3)), ("T3", (0.15e-3, 0.6e-3))])
def test_number_of_cells_is_foreseen(section, element, sizes):
    fingertip, source = change(section=section), MeshSizes(*sizes, element=element)
    made = source.build(fingertip).t.shape[1]
    assert 0.6 * made < source.estimated_cells(fingertip) < 1.5 * made


def test_inspection_gives_the_mesh_with_the_quality_of_its_regions():
    found = MeshSizes(0.15e-3, 0.6e-3).inspect(change())
    (table,) = found.tables
    assert [row[0] for row in table.rows] == ["epidermis", "dermis", "tissue", "phalanx"]
    assert sum(row[1] for row in table.rows) == found.mesh.t.shape[1]
