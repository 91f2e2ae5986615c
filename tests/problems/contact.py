"""Contact problems of one step, and Signorini's and Coulomb's conditions one by one.

The solver states how far its forces r are from their projection, e relative to the largest force F. What that means
for gaps and slips y = W r + q follows here from the conditions themselves, without the projection: with the
compliance w of a node's own direction, min(r_n, y_n / w_n) is zero up to e F, and so on.
"""

from dataclasses import dataclass

import numpy as np

from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.solve.projection import project, step_lengths

TOLERANCE = 1e-10
ROUNDING = 1e-13


@dataclass(frozen=True)
class Problem:
    """A body's compliance, the compliance of the penalties, the free motion and the friction coefficients."""

    body: np.ndarray
    penalty: np.ndarray
    free: np.ndarray
    friction: np.ndarray

    @property
    def compliance(self):
        return self.body + np.diag(self.penalty.ravel())

    @property
    def arguments(self):
        """What the solver takes: W, q and mu."""
        return self.compliance, self.free, self.friction

    def solution(self):
        start = np.zeros_like(self.free)
        return solve_friction(*self.arguments, start, TOLERANCE)


def random_problem(seed, dim, count, decades, friction):
    """Return a problem with a random body's compliance, and penalties that spread over `decades`."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(count * dim, count * dim))
    body = factor @ factor.T / (count * dim)
    penalty = np.repeat(10.0 ** rng.uniform(-decades, 0.0, (count, 2)), [1, dim - 1], axis=1)
    return Problem(body, penalty, rng.normal(size=(count, dim)), np.full(count, friction))


def pressed_row(count, slide=0.0, mu=0.6):
    """Return W, penalties, q and mu of a shallow arch of nodes on an elastic row, pressed and pulled sideways."""
    x = np.linspace(-1.0, 1.0, count)
    body = np.kron(0.1 / (np.abs(x[:, None] - x) + 0.5 / count), np.eye(2) + 0.1 * (np.eye(2, k=1) + np.eye(2, k=-1)))
    free = np.column_stack([x**2 - 0.5, np.full(count, slide)])
    return body + 0.1 * np.eye(2 * count), np.full((count, 2), 0.1), free, np.full(count, mu)


def friction_residual(compliance, free, friction, forces):
    """Return how far forces (n_c, dim) [N] are from their projection, same shape; zero at a solution."""
    scale = step_lengths(np.diag(compliance).reshape(free.shape))
    slip = (compliance @ forces.ravel()).reshape(free.shape) + free
    return forces - project(forces - scale * slip, friction)


def assert_conditions(problem, solution):
    """Check all conditions to the stated residual and the rounding of W r + q."""
    compliance, forces, friction = problem.compliance, solution.forces, problem.friction
    count, dim = forces.shape
    motion = (compliance @ forces.ravel()).reshape(count, dim) + problem.free
    rounding = (np.abs(compliance) @ np.abs(forces).ravel()).reshape(count, dim) + np.abs(problem.free)
    own = np.diag(compliance).reshape(count, dim)
    own = np.column_stack([own[:, 0], own[:, 1:].mean(axis=1)])
    close = max(solution.residual, ROUNDING) * np.abs(forces).max() + ROUNDING * rounding.max(axis=1) / own.min(axis=1)
    assert_signorini(problem, forces[:, 0], motion[:, 0], close, own[:, 0])
    for node in range(count):
        limit = friction[node] * max(forces[node, 0], 0.0)
        margin = (np.sqrt(2.0) + friction[node]) * close[node]
        assert_coulomb(forces[node, 1:], motion[node, 1:] / own[node, 1], limit, margin)


def assert_signorini(problem, normal, gap, close, own):
    """No tension, no gap where there is force, and the penalty law between force and penetration."""
    assert (normal >= -close).all(), "tension"
    assert (np.abs(np.minimum(normal, gap / own)) <= close).all(), "force and gap"
    penetration = np.maximum(problem.penalty[:, 0] * normal - gap, 0.0)
    assert (np.abs(problem.penalty[:, 0] * normal - penetration) <= 2 * own * close).all(), "penalty law"


def assert_coulomb(traction, slip, limit, margin):
    """Check one node; `slip` is in units of force, over the node's own compliance."""
    size, slipped = np.linalg.norm(traction), np.linalg.norm(slip)
    assert size <= limit + margin, "outside the cone"
    if slipped <= margin:
        return
    assert size >= limit - margin, "slip within the cone"
    if size > 10 * margin:
        along = slip @ traction / size
        assert along <= margin, "slip along the traction"
        across = np.linalg.norm(slip - along * traction / size)
        assert across <= margin * (1 + 2 * slipped / size), "slip beside the traction"
