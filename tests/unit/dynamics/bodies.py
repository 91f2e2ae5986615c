"""Free directions of rigid bodies."""

from __future__ import annotations

import numpy as np

from fingerslip.dynamics.system.bodies import RigidFreedom


def driven(face, normal=(0.0, 1.0)):
    """Return the free direction of a counterface in the plane that a force drives along its normal."""
    none = np.zeros((2, 2))
    return RigidFreedom(None, None, (face,), np.asarray(normal), none, np.zeros(2), mass=1.0)
