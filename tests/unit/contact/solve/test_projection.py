"""The projection on Coulomb's cone section: closed forms."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.solve.projection import project, step_lengths


def test_forces_inside_the_cone_stay_and_others_come_to_its_wall_or_vanish():
    trial = np.array([[2.0, 0.3, 0.4], [2.0, 3.0, 4.0], [-1.0, 5.0, 5.0], [0.0, 1.0, 0.0]])
    found = project(trial, np.full(4, 0.5))
    np.testing.assert_allclose(found, [[2.0, 0.3, 0.4], [2.0, 0.6, 0.8], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_step_lengths_are_inverse_compliances_with_one_value_for_both_tangents():
    np.testing.assert_allclose(step_lengths(np.array([[2.0, 4.0, 12.0]])), [[0.5, 0.125, 0.125]])
