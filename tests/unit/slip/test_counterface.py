"""Forces and directions of counterfaces."""

from __future__ import annotations

import doctest

import numpy as np
import pytest

from fingerslip.slip import contact_forces, slide_tangent
from fingerslip.slip import windows as counterface
from fingerslip.slip.windows import ContactForces, counterface_normal, split_along
from unit.report.scenes import block_history
from unit.synthetic import Process, make

HISTORY = make(Process())


def test_parts_along_the_normal_and_beside_it_add_up() -> None:
    rng = np.random.default_rng(0)
    vectors, normals = rng.normal(size=(4, 7, 3)), rng.normal(size=(7, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    along, tangential = split_along(vectors, normals)
    np.testing.assert_allclose(along[..., None] * normals + tangential, vectors, atol=1e-14)
    np.testing.assert_allclose(np.einsum("tnc,nc->tn", tangential, normals), 0.0, atol=1e-14)
    assert doctest.testmod(counterface).failed == 0


def test_forces_of_a_turned_plate_are_those_of_the_level_one() -> None:
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    turned = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [turn @ [0.0, 1.0]]))
    turned = turned.assign(
        counterface_force=HISTORY["counterface_force"].copy(data=HISTORY["counterface_force"].values @ turn.T)
    )
    level, inclined = contact_forces(HISTORY), contact_forces(turned)
    np.testing.assert_allclose(inclined.normal, level.normal, atol=1e-12)
    np.testing.assert_allclose(inclined.friction, level.friction, atol=1e-12)
    np.testing.assert_allclose(level.friction, np.abs(HISTORY["counterface_force"].values[:, 0, 0]), atol=1e-15)


def test_ratio_is_missing_without_pressure() -> None:
    forces = ContactForces(np.array([0.0, 1e-12, 0.5, 1.0]), np.array([[0.1, 0.0], [0.1, 0.0], [0.3, 0.4], [0.2, 0.0]]))
    np.testing.assert_allclose(forces.ratio(), [np.nan, np.nan, 1.0, 0.2])
    np.testing.assert_allclose(forces.ratio(0.6), [np.nan, np.nan, np.nan, 0.2])


def test_second_counterface_has_its_own_force() -> None:
    force = np.concatenate([HISTORY["counterface_force"].values, 2.0 * HISTORY["counterface_force"].values], axis=1)
    normals = np.array([[0.0, 1.0], [0.0, 1.0]])
    two = HISTORY.drop_dims("counterface").assign(counterface_force=(("time", "counterface", "component"), force))
    two = two.assign_coords(counterface_normal=(("counterface", "component"), normals))
    np.testing.assert_allclose(contact_forces(two, 1).normal, 2.0 * contact_forces(two, 0).normal)


def test_tangent_in_the_plane_is_the_normal_turned_clockwise() -> None:
    assert slide_tangent(HISTORY).tolist() == [1.0, 0.0]
    tilted = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [[0.6, 0.8]]))
    assert slide_tangent(tilted) == pytest.approx([0.8, -0.6])
    assert counterface_normal(tilted).tolist() == [0.6, 0.8]


def test_tangent_in_space_is_the_direction_of_the_furthest_travel_along_the_surface() -> None:
    history = block_history()
    assert slide_tangent(history) == pytest.approx([1.0, 0.0, 0.0])
    travel = history["counterface_displacement"].copy()
    travel[:, 0] = np.linspace(0.0, 1.0, history.sizes["time"])[:, None] * [0.0, 3.0, 4.0]
    sideways = history.assign(counterface_displacement=travel)
    assert slide_tangent(sideways) == pytest.approx([0.0, 1.0, 0.0]), "the normal is z"
    at_rest = history.assign(counterface_displacement=0.0 * travel)
    assert slide_tangent(at_rest) == pytest.approx([1.0, 0.0, 0.0])
