"""Random frictional contact problems, easy and nasty, and the conditions that every answer has to keep."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

BODIES = ("full rank", "spread", "nearly singular", "rigid motion")
DRIVES = ("random", "open", "sliding", "touching")


def body_compliance(kind, size, rng):
    """Return a random symmetric positive definite matrix (size, size) of the order of one.

    Its condition number is some hundreds or thousands, up to 1e6 where the eigenvalues spread, 1e9 where most of them
    nearly vanish, and 1e6 where one soft motion stands for a body that hardly anything holds.
    """
    factor = rng.normal(size=(size, size))
    turn, _ = np.linalg.qr(factor)
    match kind:
        case "full rank":
            return factor @ factor.T / size + 1e-3 * np.eye(size)
        case "spread":
            return turn * 10.0 ** rng.uniform(-6.0, 0.0, size) @ turn.T
        case "nearly singular":
            values = np.where(np.arange(size) <= size // 3, rng.uniform(0.1, 1.0, size), 1e-9)
            return turn * values @ turn.T
        case _:
            return np.eye(size) + 1e6 * np.outer(turn[0], turn[0])


def free_motion(kind, count, dim, rng):
    """Return gaps and slips without contact forces (count, dim), the normal first."""
    free = rng.normal(size=(count, dim))
    match kind:
        case "open":
            free[:, 0] = 0.01 + np.abs(free[:, 0])
        case "sliding":
            free[:, 0], free[:, 1:] = -1.0, 100.0 * np.eye(dim - 1)[0]
        case "touching":
            free[:, 0] *= 1e-9
    return free


def penalty_compliances(decade, spread, count, dim, rng):
    """Return the compliances of the penalties (count, dim), different in both directions and at every node."""
    own = 10.0 ** (decade + rng.uniform(0.0, spread, (count, 2)))
    return own[:, [0] + [1] * (dim - 1)]


def shapes(largest):
    """Return the strategies that all random problems share."""
    return {
        "seed": st.integers(0, 2**31),
        "dim": st.sampled_from([2, 3]),
        "count": st.sampled_from([1]) | st.integers(1, largest),
        "body": st.sampled_from(BODIES),
        "drive": st.sampled_from(DRIVES),
        "decade": st.integers(-6, 0),
        "spread": st.sampled_from([0.0, 2.0]),
        "friction": st.sampled_from([0.0, 1.0, 5.0]) | st.floats(0.0, 5.0),
    }


def broken_conditions(normal, tangential, gap, slip, friction, force, length):  # noqa: PLR0917
    """Return which of Signorini's and Coulomb's conditions do not hold, beyond errors `force` and `length`.

    Parameters
    ----------
    normal, gap : (n,) array
        Normal forces, pressing is positive, and gaps with the penalties' own closing taken out.
    tangential, slip : (n, dim - 1) array
        Friction forces on the body, and slips with the penalties' elastic part taken out.
    friction : (n,) array
        Friction coefficients.
    force : float
        Error of a force that is allowed.
    length : (n,) array
        Error of a gap or slip that is allowed at each node.
    """
    size, way = np.linalg.norm(tangential, axis=1), np.linalg.norm(slip, axis=1)
    limit = friction * normal
    slides = way > length
    # Friction that opposes slip makes their product -|t| |s|; what is missing to that measures any other direction.
    missing = size * way + np.sum(tangential * slip, axis=1)
    tests = {
        "tension": normal < 0.0,
        "penetration": gap < -length,
        "force across a gap": (normal > force) & (gap > length),
        "friction beyond the cone": size > limit * (1 + 1e-12) + force,
        "slip below the limit": slides & (size < limit - (1 + friction) * force),
        "slip not against friction": slides & (missing > 2.0 * (force * way + length * size)),
    }
    return [name for name, broken in tests.items() if broken.any()]
