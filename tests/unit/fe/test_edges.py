"""Free edges of boundaries, and how far nodes are from them."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.fe.space import Space, boundary_nodes, build_space, free_edge_distances, free_edge_nodes
from fingerslip.verification.meshes import box

SIDES = np.linspace(0.0, 1.0, 5)


def space_of(element: str) -> Space:
    """Return the space of a unit block with a boundary ``bottom``."""
    dim = 2 if element in ("Q4", "T3", "T6") else 3
    return build_space(box(element, *(SIDES,) * dim))


def free(space: Space) -> np.ndarray:
    return np.zeros((len(space.positions), space.dim), dtype=bool)


@pytest.mark.parametrize("element", ["Q4", "T3", "T6", "T4", "T10", "H8"])
def test_edge_of_a_side_is_its_rim(element: str) -> None:
    space = space_of(element)
    own = boundary_nodes(space, "bottom")
    found = free_edge_nodes(space, "bottom", free(space))
    across = space.positions[own][:, :-1]
    rim = own[((across < 1e-12) | (across > 1.0 - 1e-12)).any(axis=1)]
    assert found.tolist() == rim.tolist()
    distances = free_edge_distances(space, "bottom", free(space), own)
    expected = np.minimum(across, 1.0 - across).min(axis=1)
    np.testing.assert_allclose(distances, expected, atol=0.25 if space.dim == 3 else 1e-12)
    assert not distances[np.isin(own, rim)].any()


def test_an_edge_at_a_held_face_is_no_free_edge() -> None:
    space = space_of("Q4")
    held = free(space)
    held[space.positions[:, 0] < 1e-12] = True
    nodes = free_edge_nodes(space, "bottom", held)
    assert space.positions[nodes].tolist() == [[1.0, 0.0]]


def test_a_plane_of_symmetry_is_held_and_one_fixed_node_is_not_a_held_face() -> None:
    space = space_of("T4")
    held = free(space)
    held[space.positions[:, 0] < 1e-12, 0] = True
    nodes = free_edge_nodes(space, "bottom", held)
    # The corners of the symmetric side belong to the free sides beside it.
    symmetric = space.positions[nodes][:, 0] < 1e-12
    assert sorted(space.positions[nodes][symmetric][:, 1]) == pytest.approx([0.0, 1.0])
    one = free(space)
    one[0] = True
    assert free_edge_nodes(space, "bottom", one).tolist() == free_edge_nodes(space, "bottom", free(space)).tolist()


def test_components_held_at_different_nodes_do_not_hold_a_face() -> None:
    space = space_of("Q4")
    side = np.flatnonzero(space.positions[:, 0] < 1e-12)
    held = free(space)
    held[side[::2], 0] = held[side[1::2], 1] = True
    assert 0.0 in space.positions[free_edge_nodes(space, "bottom", held)][:, 0]


def test_a_closed_boundary_has_no_edge() -> None:
    mesh = skfem.MeshQuad.init_tensor(SIDES, SIDES)
    space = build_space(mesh.with_boundaries({"all": mesh.boundary_facets()}))
    assert free_edge_nodes(space, "all", free(space)).size == 0
    assert np.isinf(free_edge_distances(space, "all", free(space), np.arange(3))).all()
