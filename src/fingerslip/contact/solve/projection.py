"""The projection of contact forces onto what contact and friction allow, and the search along a line.

Solvers of a step find forces that are their own projection; what a step does with them, by the contact law:
:mod:`fingerslip.contact.interface`.
"""

from __future__ import annotations

import numba
import numpy as np

# Iterations of Newton's method, and halvings of one of its steps, before the solver tries something else.
NEWTON_LIMIT, SEARCH_LIMIT = 60, 12
# Share of the decrease promised by the slope that a step must achieve (Armijo's rule).
_SUFFICIENT = 1e-4


@numba.njit(cache=True, nogil=True)
def decreases_enough(new_merit, merit, length):  # type: ignore[no-untyped-def]
    """Tell whether a step of relative `length` decreases the merit, the sum of squared residuals [N^2], enough."""
    return new_merit <= (1.0 - 2.0 * _SUFFICIENT * length) * merit


@numba.njit(cache=True, nogil=True)
def step_lengths(diagonal):  # type: ignore[no-untyped-def]
    """Return the step lengths rho of the projection, shape (n_c, dim) [N/m].

    Arrays: diagonal (n_c, dim) [m/N].
    """
    scale = np.empty_like(diagonal)
    for i in range(diagonal.shape[0]):
        scale[i, 0] = 1.0 / diagonal[i, 0]
        scale[i, 1:] = 1.0 / np.mean(diagonal[i, 1:])
    return scale


@numba.njit(cache=True, nogil=True)
def project_node(trial, friction, out):  # type: ignore[no-untyped-def]
    """Write the projection of one node's trial force (dim,) [N] into `out`; see :func:`project`."""
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
    """Return trial forces to Coulomb's cone, node by node: the return mapping of the contact law.

    With the trial force z, normal part first, the force r is ::

        open     r = 0                                    where z_n <= 0
        stick    r = z                                    where |z_t| <= mu z_n
        slip     r_n = z_n,  r_t = mu z_n z_t / |z_t|     elsewhere

    Applied to z = r - rho y with the slip y of a step, its fixed points are the solutions of the contact conditions
    (Alart & Curnier 1991).

    Arrays: trial (n_c, dim) [N]; friction (n_c,) [-]; returns (n_c, dim) [N].

    Examples
    --------
    Three nodes with mu = 0.5. The first sticks, the second slips, the third is open:

    >>> project(np.array([[2.0, 0.6], [2.0, 3.0], [-1.0, 3.0]]), np.full(3, 0.5)).tolist()
    [[2.0, 0.6], [2.0, 1.0], [0.0, 0.0]]
    """
    out = np.empty_like(trial)
    for i in range(trial.shape[0]):
        project_node(trial[i], friction[i], out[i])
    return out


@numba.njit(cache=True, nogil=True)
def derivative(trial, friction, block):  # type: ignore[no-untyped-def]
    """Write the derivative of the projection at a touching node's trial force (dim,) [N] into `block` (dim, dim)."""
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
