"""The projection on Coulomb's cone that the contact conditions are, and its derivative, compiled."""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["derivative", "project", "project_node", "step_lengths"]


@numba.njit(cache=True, nogil=True)
def step_lengths(diagonal):  # type: ignore[no-untyped-def]
    """Return rho, the inverse diagonal of W (n_c, dim), normal and mean tangential for each node."""
    scale = np.empty_like(diagonal)
    for i in range(diagonal.shape[0]):
        scale[i, 0] = 1.0 / diagonal[i, 0]
        scale[i, 1:] = 1.0 / np.mean(diagonal[i, 1:])
    return scale


@numba.njit(cache=True, nogil=True)
def project_node(trial, friction, out):  # type: ignore[no-untyped-def]
    """Project one node's trial force on the Coulomb cone section at its own normal part."""
    out[:] = 0.0
    if trial[0] <= 0.0:
        return
    out[0] = trial[0]
    length = np.sqrt(np.sum(trial[1:] ** 2))
    limit = friction * trial[0]
    factor = 1.0 if length <= limit else limit / length
    out[1:] = factor * trial[1:]


@numba.njit(cache=True, nogil=True)
def project(trial, friction):  # type: ignore[no-untyped-def]
    """Project the trial forces (n_c, dim) of all nodes."""
    out = np.empty_like(trial)
    for i in range(trial.shape[0]):
        project_node(trial[i], friction[i], out[i])
    return out


@numba.njit(cache=True, nogil=True)
def derivative(trial, friction, block):  # type: ignore[no-untyped-def]
    """Write the derivative of the projection of a touching node's trial force into `block`."""
    dim = trial.size
    block[:, :] = 0.0
    block[0, 0] = 1.0
    length = np.sqrt(np.sum(trial[1:] ** 2))
    limit = friction * trial[0]
    if length <= limit:
        for k in range(1, dim):
            block[k, k] = 1.0
        return
    for k in range(1, dim):
        block[k, 0] = friction * trial[k] / length
        for m in range(1, dim):
            direction = (1.0 if k == m else 0.0) - trial[k] * trial[m] / length**2
            # In 2D the direction of sliding cannot turn; rounding must not leave a trace of it.
            block[k, m] = limit / length * direction if dim > 2 else 0.0
