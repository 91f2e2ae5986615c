"""The compiled passes against the same sums in NumPy."""

from __future__ import annotations

import numpy as np

from fingerslip.dynamics.step.memory_kernels import across_and_along, along, remembered_force

SHARES, DECAY = np.array([0.3, 0.2]), np.array([0.5, 0.9])
END, START = np.array([0.2, 0.04]), np.array([0.3, 0.06])
RNG = np.random.default_rng(0)


def fields(rows, count=5):
    return RNG.normal(size=(rows, count)), RNG.normal(size=(2, rows, count))


def followed(end, start, dashpots):
    return END[:, None, None] * end + START[:, None, None] * start + DECAY[:, None, None] * dashpots


def weighted(values):
    return np.tensordot(SHARES, values, axes=1)


def test_pass_along_follows_the_dashpots_and_sums_the_energies_up():
    before, dashpots = fields(2)
    relaxed, after = weighted(dashpots), RNG.normal(size=(2, 5))
    found, total = np.empty_like(dashpots), np.empty_like(relaxed)
    stored, moved, own = along(SHARES, DECAY, END, START, before, dashpots, relaxed, after, found, total)
    expected = followed(after, before, dashpots)
    np.testing.assert_allclose(found, expected)
    np.testing.assert_allclose(total, weighted(expected))
    np.testing.assert_allclose(own, weighted((expected[:, 0] * expected[:, 1]).sum(axis=-1)))
    np.testing.assert_allclose(stored, 0.5 * own - after[0] @ total[1])
    np.testing.assert_allclose(moved, (before[0] + after[0]) @ (total[1] - relaxed[1]))


def test_pass_across_keeps_the_stress_across_away():
    """With c, d of Poisson's ratio: k (u - w) = (2 G/3) R[u + 2 w] in every node."""
    from fingerslip.materials.viscoelastic import across_of

    across_law = across_of(0.4)
    share = float(SHARES @ END)
    parts = (*across_law.of_step(share), across_law.along, across_law.bulk)
    (given, dashpots), (across, across_dashpots) = fields(3), fields(2)
    before = (given, dashpots, weighted(dashpots), across, across_dashpots, weighted(across_dashpots))
    after = [np.empty_like(own) for own in before]
    after[0][:] = RNG.normal(size=(3, 5))
    across_and_along(SHARES, DECAY, END, START, parts, *before, *after)
    np.testing.assert_allclose(after[1], followed(after[0], given, dashpots))
    np.testing.assert_allclose(after[4], followed(after[3], across, across_dashpots))
    np.testing.assert_allclose(after[5], weighted(after[4]))
    u, w = after[0][::2], after[3]
    strain = u + 2 * w - (after[2][::2] + 2 * after[5])
    np.testing.assert_allclose(across_law.bulk * (u - w), strain / 3.0, atol=1e-12)


def test_remembered_force_is_that_of_what_the_start_gives():
    (given, dashpots), (across, across_dashpots) = fields(3), fields(2)
    force = np.empty(5)
    weights = SHARES * START, SHARES * DECAY
    remembered_force(*weights, 0.7, given, dashpots, across, across_dashpots, force)
    own = weights[0].sum() * given + np.tensordot(weights[1], dashpots, axes=1)
    thin = weights[0].sum() * across + np.tensordot(weights[1], across_dashpots, axes=1)
    np.testing.assert_allclose(force, own[1] + thin[1] - 0.7 * (own[2] + 2 * thin[1]))
    none = np.zeros((0, 5)), np.zeros((2, 0, 5))
    remembered_force(*weights, 0.0, given[:2], dashpots[:, :2], *none, force)
    np.testing.assert_allclose(force, own[1])
