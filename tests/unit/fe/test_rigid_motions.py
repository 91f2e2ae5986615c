"""Rigid motions that supports leave free are found and named."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.fe.space import boundary_nodes, build_space, free_pieces, vector_dofs
from fingerslip.verification.meshes import box

GRID = np.linspace(0.0, 4e-3, 5)
X, Y, Z = (f"translation along {axis}" for axis in "xyz")
ABOUT_X, ABOUT_Y, ABOUT_Z = (f"rotation about {axis}" for axis in "xyz")


def pieces_of(element, supports):
    """Return the free pieces of a block whose boundaries are held in some components."""
    space = build_space(box(element, *(GRID,) * (2 if element in {"Q4", "T3", "T6"} else 3)))
    held = [np.zeros(0, dtype=np.int64)]
    for name, components in supports.items():
        dofs = vector_dofs(boundary_nodes(space, name), space.dim)
        held.append(dofs[:, ["xyz".index(component) for component in components]].ravel())
    return free_pieces(space, np.setdiff1d(np.arange(space.n_dofs), np.concatenate(held)))


@pytest.mark.parametrize("element", ["Q4", "T3", "T6"])
@pytest.mark.parametrize(
    ("supports", "motions"),
    [
        ({}, (X, Y, ABOUT_Z)),
        ({"left": "x"}, (Y,)),
        ({"left": "y"}, (X, ABOUT_Z)),
        ({"left": "y", "bottom": "y"}, (X,)),
        ({"left": "xy"}, ()),
        ({"left": "x", "bottom": "y"}, ()),
    ],
)
def test_motions_in_the_plane(element, supports, motions):
    assert [piece.motions for piece in pieces_of(element, supports)] == ([motions] if motions else [])


@pytest.mark.parametrize("element", ["H8", "T4", "T10"])
@pytest.mark.parametrize(
    ("supports", "motions"),
    [
        ({}, (X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z)),
        ({"left": "x"}, (Y, Z, ABOUT_X)),
        ({"left": "x", "bottom": "z"}, (Y,)),
        ({"left": "xy"}, (Z,)),
        ({"left": "xyz"}, ()),
    ],
)
def test_motions_in_space(element, supports, motions):
    assert [piece.motions for piece in pieces_of(element, supports)] == ([motions] if motions else [])


def test_a_single_held_node_leaves_the_rotation_about_it():
    space = build_space(box("Q4", GRID, GRID))
    for corner in (0, len(space.positions) // 2):
        free = np.setdiff1d(np.arange(space.n_dofs), [2 * corner, 2 * corner + 1])
        assert [piece.motions for piece in free_pieces(space, free)] == [(ABOUT_Z,)]


def test_pieces_that_hang_apart_are_judged_one_by_one():
    one = box("Q4", GRID, GRID)
    both = skfem.MeshQuad(np.hstack([one.p, one.p + 10e-3]), np.hstack([one.t, one.t + one.p.shape[1]]))
    space = build_space(both.with_subdomains({"both": np.arange(both.nelements)}))
    second = np.arange(one.p.shape[1], both.p.shape[1])
    held = vector_dofs(np.setdiff1d(np.arange(both.p.shape[1]), second), 2).ravel()
    (piece,) = free_pieces(space, np.setdiff1d(np.arange(space.n_dofs), held))
    assert piece.nodes.tolist() == second.tolist()
    assert piece.motions == (X, Y, ABOUT_Z)


def test_size_and_place_of_the_body_make_no_difference():
    for scale, shift in ((1e-6, 0.0), (1e3, 0.0), (1e-3, 10.0)):
        mesh = box("Q4", scale * GRID + shift, scale * GRID - shift)
        space = build_space(mesh)
        left = vector_dofs(boundary_nodes(space, "left"), 2)[:, 0]
        (piece,) = free_pieces(space, np.setdiff1d(np.arange(space.n_dofs), left))
        assert piece.motions == (Y,)
