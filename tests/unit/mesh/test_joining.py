"""Meshes of several bodies become one, in which they stay apart."""

import dataclasses

import numpy as np
import pytest
import skfem

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.fe.space import build_space
from fingerslip.verification.meshes import box, dimension
from problems.blocks import EVERY_ELEMENT
from problems.held import held
from problems.pushed import curved, push_and_slide


def body(element, start):
    """Return a block that begins at `start` along x, in 2D with a curved lower side."""
    dim = dimension(element)
    axes = np.linspace(start, start + 1.0, 3), *[np.linspace(0.0, 1.0, 3)] * (dim - 1)
    return box(element, *axes, shift=curved(4.0) if dim == 2 else None)


def in_order(points):
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_bodies_keep_their_points_cells_and_names(element):
    parts = {"left": body(element, 0.0), "right": body(element, 1.0)}
    joined = fs.join_meshes(parts)
    assert type(joined) is type(parts["left"])
    spaces = [build_space(mesh) for mesh in (*parts.values(), joined)]
    apart = np.vstack([own.positions for own in spaces[:2]])
    assert len(spaces[2].positions) == len(apart), "nodes that touch stay two"
    np.testing.assert_array_equal(in_order(spaces[2].positions), in_order(apart))
    for name, mesh in parts.items():
        for own, facets in mesh.boundaries.items():
            of_part = mesh.p[:, mesh.facets[:, np.asarray(facets)]]
            found = np.asarray(joined.boundaries[f"{name}_{own}"])
            np.testing.assert_array_equal(joined.p[:, joined.facets[:, found]], of_part)
        cells = joined.subdomains[f"{name}_bulk"]
        np.testing.assert_array_equal(joined.p[:, joined.t[:, cells]], mesh.p[:, mesh.t])
    assert len(joined.boundaries) == 2 * len(parts["left"].boundaries)


def test_middles_of_curved_edges_stay_where_they_are():
    curved_one = fs.join_meshes({"a": body("T6", 0.0)})
    bent = curved_one.doflocs.copy()
    bent[1, curved_one.nvertices :] += 0.01 * np.sin(bent[0, curved_one.nvertices :])
    mesh = type(curved_one)(bent, curved_one.t, curved_one._boundaries, curved_one._subdomains)
    both = build_space(fs.join_meshes({"a": mesh, "b": mesh.translated((3.0, 0.0))})).positions
    own = build_space(mesh).positions
    for shift in (0.0, 3.0):
        moved = own + np.array([shift, 0.0])
        assert np.linalg.norm(both[:, None] - moved[None], axis=2).min(axis=0).max() < 1e-12


def test_sides_of_inner_boundaries_are_kept():
    mesh = body("Q4", 0.0)
    inner = mesh.facets_satisfying(lambda x: np.abs(x[0] - 0.5) < 1e-9)
    mesh = mesh.with_boundaries({"cut": skfem.generic_utils.OrientedBoundary(inner, np.ones(inner.size, dtype=int))})
    joined = fs.join_meshes({"a": mesh, "b": mesh})
    assert joined.boundaries["b_cut"].ori.tolist() == [1, 1]


def test_a_body_in_a_joined_mesh_moves_as_by_itself():
    """The other one is held, and far away."""
    alone = push_and_slide(programme=(fs.Press(0.4e-3, 8e-3), fs.Slide(0.4e-3, 8e-3)))
    joined = dataclasses.replace(
        alone,
        mesh=fs.join_meshes({"pad": alone.mesh, "other": body("Q4", 1.0)}),
        materials=dict.fromkeys(("pad_bulk", "other_bulk"), alone.materials["bulk"]),
        supports={"pad_top": ("x", "y"), "other_bulk": ("x", "y")},
        contacts=(fs.Contact("pad_bottom", friction=fs.Coulomb(0.4)),),
    )
    expected, history = fs.simulate(alone), fs.simulate(joined)
    scale = 1e-9 * np.abs(expected.counterface_force.values).max()
    np.testing.assert_allclose(history.counterface_force.values, expected.counterface_force.values, atol=scale)
    np.testing.assert_allclose(history.support_force.values[:, :1], expected.support_force.values, atol=scale)


def test_a_body_of_two_that_nothing_holds_is_named():
    alone = {"contacts": (), "bodies": {}, "supports": {"left_left": ("x", "y")}, "support_motions": {}}
    with pytest.raises(InputError, match=r"supports: leave translation along x.*of the piece around x = 10 mm, y = 0"):
        fs.simulate(held(time=fs.QuasiStatic(1e-3, end=0.1), **alone))


@pytest.mark.parametrize(
    ("meshes", "message"),
    [
        ({}, r"meshes: got none"),
        ({"a": body("Q4", 0.0), "b": body("T3", 0.0)}, r"got a: MeshQuad1, b: MeshTri1, needs cells of one kind"),
        (
            {"a": body("Q4", 0.0).with_subdomains({"b_bulk": np.array([0])}), "a_b": body("Q4", 0.0)},
            r"two subdomains become 'a_b_bulk', needs names that stay apart; rename a body",
        ),
    ],
)
def test_meshes_that_cannot_be_joined_are_refused(meshes, message):
    with pytest.raises(InputError, match=message):
        fs.join_meshes(meshes)
