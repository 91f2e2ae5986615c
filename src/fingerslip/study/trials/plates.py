"""The plate of a trial: it moves as prescribed, or is free to fall under a load."""

from __future__ import annotations

import math

import numpy as np

from fingerslip.model.programme import Phase
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.study.definition.spec import Study

__all__ = ["load_rate", "plate_of", "programme_of"]


def plate_of(study: Study) -> RigidBody | None:
    """Return the rigid body that the plate of a study is; None where its contact has none."""
    name = study.all_contacts[0].rigid_body
    return None if name is None else study.bodies[name]


def programme_of(study: Study) -> tuple[Phase, ...]:
    """Return how the plate of a study moves in the directions in which it is not free."""
    plate = plate_of(study)
    return study.programme if plate is None else plate.programme


def load_rate(plate: RigidBody) -> float:
    """Return how fast the loads on a plate grow at most, each for itself [N/s]."""
    total = 0.0
    for load in plate.loads:
        times, factors = np.asarray(load.ramp.times), np.asarray(load.ramp.factors)
        slopes = np.abs(np.diff(factors) / np.diff(times))
        total += math.hypot(load.x, load.y, load.z) * float(slopes.max(initial=0.0))
    return total
