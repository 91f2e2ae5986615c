"""Principal values and directions of many tensors at once, among them degenerate ones, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.finite.kernels import LANES, ROWS, diagonalise


def tensors():
    """Return symmetric tensors (LANES, 3, 3): of many sizes, without shear, with values alike, and none at all."""
    found = np.random.default_rng(0).normal(size=(LANES, 3, 3))
    found *= np.logspace(-200, 100, LANES)[:, None, None]
    found[:4] = 0.0
    found[1] = np.diag([3.0, 1.0, 2.0])
    found[2] = np.ones((3, 3))
    found[3, 0, 1] = found[3, 1, 0] = 1.0
    return found + found.transpose(0, 2, 1)


def diagonalised(given):
    lanes = np.empty((ROWS, LANES))
    lanes[:3] = given[:, [0, 1, 2], [0, 1, 2]].T
    lanes[3:6] = given[:, [0, 0, 1], [1, 2, 2]].T
    diagonalise(lanes)
    return lanes[:3].T, lanes[6:].T.reshape(-1, 3, 3).transpose(0, 2, 1)


def test_values_and_directions_make_the_tensors():
    given = tensors()
    values, directions = diagonalised(given)
    sizes = np.abs(given).max(axis=(1, 2))
    errors = np.abs(np.einsum("pik,pk,pjk->pij", directions, values, directions) - given).max(axis=(1, 2))
    # Below 1e-150 shear is taken as none, also for its size.
    np.testing.assert_array_less(errors, 1e-14 * sizes + 1e-149)
    np.testing.assert_allclose(
        directions.transpose(0, 2, 1) @ directions, np.tile(np.eye(3), (LANES, 1, 1)), atol=1e-14
    )


@pytest.mark.parametrize("lane", [0, LANES - 1])
def test_what_is_no_number_stays_alone(lane):
    given = tensors()
    expected = diagonalised(given)[0]
    given[lane] = np.nan
    values = diagonalised(given)[0]
    others = np.arange(LANES) != lane
    assert np.isnan(values[lane]).any()
    np.testing.assert_allclose(values[others], expected[others], rtol=1e-12)
