"""First guesses of a step: extrapolated forces, with the response that the compliance gives to them."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.past import Past, first_guess, next_past

COUNT, DIM = 12, 3


@pytest.fixture
def compliance() -> Compliance:
    root = np.random.default_rng(1).normal(size=(COUNT * DIM, COUNT * DIM))
    return Compliance(root @ root.T, np.full((COUNT, DIM), 0.1), factor=0.5)


def forces(seed: int) -> np.ndarray:
    found = np.random.default_rng(seed).normal(size=(COUNT, DIM))
    found[:, 0] = np.maximum(np.abs(found[:, 0]) - 0.3, 0.0)
    found[found[:, 0] <= 0.0] = 0.0
    return found


def two_steps(compliance: Compliance) -> Past:
    """Return what two steps leave, with the forces of three seeds at their starts and ends."""
    first, second, third = map(forces, (1, 2, 3))
    past = next_past(None, second, compliance.response(second), first, None)
    assert past.response_before is None
    return next_past(past, third, compliance.response(third), second, None)


def test_the_response_to_a_guess_is_that_of_the_compliance(compliance: Compliance) -> None:
    past = two_steps(compliance)
    guess, response = first_guess(compliance, past, past.forces, None)
    opened = guess[:, 0] <= 0.0
    assert 0 < opened.sum() < COUNT
    assert not guess[opened].any()
    np.testing.assert_array_equal(guess[~opened], (2.0 * forces(3) - forces(2))[~opened])
    np.testing.assert_allclose(response, compliance.response(guess), rtol=1e-12, atol=1e-12)


def test_other_forces_and_compliances_have_no_known_response(compliance: Compliance) -> None:
    past = two_steps(compliance)
    assert first_guess(compliance, None, forces(5), None)[1] is None
    assert first_guess(compliance, past, forces(5), None)[1] is None
    guess, response = first_guess(compliance, past.under_other_compliance(), past.forces, None)
    np.testing.assert_array_equal(guess, first_guess(compliance, past, past.forces, None)[0])
    assert response is None
    assert next_past(past, forces(4), None, forces(5), None).response_before is None


def test_a_search_within_a_step_keeps_what_was_known_at_its_start(compliance: Compliance) -> None:
    past = two_steps(compliance)
    guess, response = first_guess(compliance, past, past.forces, past.before)
    assert guess is past.forces
    assert response is past.response
    again = next_past(past, forces(4), compliance.response(forces(4)), past.forces, past.before)
    assert again.before is past.before
    assert again.response_before is past.response_before
    assert next_past(past, forces(4), None, past.forces, forces(6)).response_before is None
