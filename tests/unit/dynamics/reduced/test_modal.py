"""In coordinates of a reduced body a step is a product: with the interface behind them, as by dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.reduced.modal import ModalFactor, condense_modes

RNG = np.random.default_rng(0)
DIAGONAL, INTERFACE = RNG.uniform(1.0, 3.0, 6), RNG.normal(size=(4, 6))
SPREAD = np.vstack([np.eye(6), INTERFACE])
INVERSE = SPREAD @ np.diag(1.0 / DIAGONAL) @ SPREAD.T
LOCAL = sparse.csr_matrix(np.hstack([np.zeros((3, 6)), np.eye(4)[[2, 0, 3]]]))


@pytest.mark.parametrize("shape", [(10,), (10, 3)])
def test_forces_on_coordinates_and_on_the_interface_move_both(shape):
    forces = RNG.normal(size=shape)
    factor = ModalFactor(DIAGONAL, INTERFACE)
    np.testing.assert_allclose(factor.backward(factor.forward(forces)), INVERSE @ forces, atol=1e-13)
    np.testing.assert_allclose(factor.transposed_backward(forces), INVERSE @ forces, atol=1e-13)


def test_compliance_is_that_of_the_local_displacements():
    _, compliance = condense_modes(DIAGONAL, INTERFACE, LOCAL)
    np.testing.assert_allclose(compliance, LOCAL @ INVERSE @ LOCAL.T, atol=1e-13)
    np.testing.assert_array_equal(compliance, compliance.T)


@pytest.mark.parametrize("columns", [(), (2,)])
def test_a_step_with_contact_forces_in_its_middle(columns):
    right, forces = RNG.normal(size=(10, *columns)), RNG.normal(size=(3, *columns))
    right[6:] = 0.0
    condensed, _ = condense_modes(DIAGONAL, INTERFACE, LOCAL)
    halfway = condensed.forward(right)
    np.testing.assert_allclose(halfway.local, LOCAL @ INVERSE @ right, atol=1e-13)
    exact = INVERSE @ (right + LOCAL.T @ forces)
    np.testing.assert_allclose(condensed.backward(halfway, forces), exact, atol=1e-13)
    np.testing.assert_allclose(condensed.backward(halfway, 0.0 * forces), INVERSE @ right, atol=1e-13)
