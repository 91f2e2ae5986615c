"""Candidates in two stages: a short search in 3D, a long one where it was too short, the same motion in both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics import narrowing, simulation
from fingerslip.dynamics.narrowing import with_short_search
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide

PRESS = 0.4e-3


def bulged(points):
    x, y, z = points
    return np.array([x, y, z + (1.0 - z / z.max()) * (x**2 + y**2) / 10e-3])


def pressed_pad(**changes):
    """Return a model in 3D: a bulged block is pressed by 0.4 mm and slid."""
    across = np.linspace(-2.5e-3, 2.5e-3, 9)
    return push_and_slide(
        mesh=box("H8", across, across, np.linspace(0.0, 3e-3, 4), shift=bulged),
        formulation="solid",
        depth=1.0,
        supports={"top": ("x", "y", "z")},
        contacts=(fs.Contact("bottom", fs.Plane((0.0, 0.0, 1.0)), fs.Coulomb(0.4)),),
        programme=(fs.Press(PRESS, 10e-3), fs.Slide(0.1e-3, 5e-3)),
        **changes,
    )


def test_in_space_the_first_search_goes_a_quarter_further_than_the_counterface():
    model = pressed_pad()
    assert with_short_search(model).contacts[0].search_distance == pytest.approx(1.25 * PRESS)
    assert model.contacts[0].search_distance is None


@pytest.mark.parametrize(
    "change",
    [
        {"gravity": (0.0, 0.0, -9.81)},
        {"contacts": (fs.Contact("bottom", fs.Plane((0.0, 0.0, 1.0)), search_distance=1e-3),)},
        {"programme": (fs.Press(1e-3, 1e-3), fs.Slide(1e-3, 1e-3, (1.0, 0.0)))},
        {"programme": (fs.Hold(0.01),)},
        {"contacts": ()},
    ],
)
def test_what_is_given_loaded_wrong_or_does_not_approach_stays_as_it_is(change):
    model = replace(pressed_pad(), **change)
    assert with_short_search(model) is model


def test_in_the_plane_nothing_changes():
    model = push_and_slide()
    assert with_short_search(model) is model


def test_fewer_candidates_move_in_the_same_way(monkeypatch):
    few = fs.simulate(pressed_pad())
    monkeypatch.setattr(simulation, "with_short_search", lambda model: model)
    every = fs.simulate(pressed_pad())
    assert few.sizes["contact_node"] < every.sizes["contact_node"]
    force = every.counterface_force.values
    np.testing.assert_allclose(few.counterface_force.values, force, atol=1e-9 * np.abs(force).max())
    same = np.isin(every.contact_node.values, few.contact_node.values)
    slip = every.slip_distance.values
    np.testing.assert_allclose(few.slip_distance.values, slip[:, same], atol=1e-9 * slip.max())
    assert not every.contact_state.values[:, ~same].any()


def test_where_a_node_outside_touches_the_simulation_starts_again_with_all(monkeypatch, caplog):
    caplog.set_level("INFO")
    whole = fs.simulate(pressed_pad())
    assert "starts again" not in caplog.text
    monkeypatch.setattr(narrowing, "_NEAR", 0.3)
    again = fs.simulate(pressed_pad())
    assert "reached the counterface" in caplog.text
    assert "starts again with more contact candidates" in caplog.text
    assert again.sizes["contact_node"] > whole.sizes["contact_node"]
    force = whole.counterface_force.values
    np.testing.assert_allclose(again.counterface_force.values, force, atol=1e-9 * np.abs(force).max())


def test_a_counterface_that_never_comes_near_is_no_error_of_the_short_search():
    """Its first stage finds no candidate, 1.3 times the approach away."""
    plane = fs.Plane((0.0, 0.0, 1.0), offset=-1.3 * PRESS)
    model = replace(pressed_pad(), contacts=(fs.Contact("bottom", plane),), programme=(fs.Press(PRESS, 10e-3),))
    assert not fs.simulate(model).contact_state.values.any()


def test_faces_of_a_body_search_as_far_as_the_body_goes():
    """The press goes along the normal of the first face: away from the second, which may be as near as it is."""
    body = fs.RigidBody(1.0, programme=(fs.Press(PRESS, 10e-3),))
    lid = fs.Contact("top", fs.Plane((0.0, 0.0, -1.0)), rigid_body="clamp")
    bottom = replace(pressed_pad().contacts[0], rigid_body="clamp")
    model = replace(pressed_pad(), contacts=(bottom, lid), bodies={"clamp": body}, programme=())
    assert [own.search_distance for own in with_short_search(model).contacts] == [pytest.approx(1.25 * PRESS), None]
