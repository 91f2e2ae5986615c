"""Shapes that overlap become a conforming mesh."""

from __future__ import annotations

import gmsh
import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import fragment, generate, gmsh_session, read_fragments


def rectangle(x, y, width, height):
    return gmsh.model.occ.addRectangle(x, y, 0.0, width, height)


@pytest.mark.parametrize("quadrilaterals", [False, True])
def test_the_later_region_keeps_what_is_shared(quadrilaterals):
    with gmsh_session():
        shapes = {"outer": [rectangle(0, 0, 4, 2)], "inner": [rectangle(1, 0.5, 2, 1)], "none": []}
        pieces = fragment(shapes, np.array([[2e-3, 1e-3]]), 2)
        generate(2, lambda *_: 0.25e-3, quadrilaterals=quadrilaterals)
        found = read_fragments(pieces, 2, 4 if quadrilaterals else 3)
    corners = found.points[found.cells]
    x, y = corners[..., 0], corners[..., 1]
    area = 0.5 * np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1))
    assert [area[found.region == number].sum() for number in (0, 1)] == pytest.approx([6e-6, 2e-6])
    assert np.linalg.norm(found.points - [2e-3, 1e-3], axis=1).min() < 1e-12


def test_a_region_that_is_covered_is_refused():
    with gmsh_session(), pytest.raises(MeshError, match="under: is covered by other regions"):
        fragment({"under": [rectangle(1, 1, 1, 1)], "over": [rectangle(0, 0, 4, 4)]}, np.empty((0, 2)), 2)


def test_pieces_of_a_region_in_space_become_one_volume_without_faces_inside():
    with gmsh_session():
        boxes = {"under": (0, 0, 0, 4, 4, 2), "over": (0, 0, 1, 4, 4, 3), "rod": (1.5, 1.5, 0.5, 1, 1, 2)}
        shapes = {name: [gmsh.model.occ.addBox(*own)] for name, own in boxes.items()}
        pieces = fragment(shapes, np.array([[2e-3, 2e-3, 2.5e-3]]), 3)
        assert {name: len(own) for name, own in pieces.items()} == {"under": 1, "over": 1, "rod": 1}
        generate(3, lambda *_: 0.5e-3)
        found = read_fragments(pieces, 3, 4)
    corners = found.points[found.cells]
    volume = np.bincount(found.region, np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)
    assert volume == pytest.approx([15.5e-9, 46.5e-9, 2e-9])
    # Conforming: nodes at one place are one node.
    assert len(np.unique(found.points.round(12), axis=0)) == len(found.points)
    assert np.linalg.norm(found.points - [2e-3, 2e-3, 2.5e-3], axis=1).min() < 1e-12
