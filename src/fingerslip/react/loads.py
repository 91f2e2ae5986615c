"""How the load on a held object changes: what there is beside its weight, in newtons over seconds."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Protocol

import numpy as np
import pydantic

from fingerslip.errors import InputError
from fingerslip.model.programme import Ramp
from fingerslip.parameters import Duration, Force, Mass, PositiveDuration, PositiveLength, one_of, parameters
from fingerslip.react.reflex import ForceRate

__all__ = ["BuiltInLoad", "DroppedBall", "Load", "LoadChoice", "LoadSeries", "RampLoad", "StepLoad"]

GRAVITY = 9.81
_PULSE_KNOTS = 9


class Load(Protocol):
    """A load along the surface of an object, on top of its weight."""

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times since it began [s], the first 0, and the force at each [N]: linear between, then constant."""


@parameters
class StepLoad:
    """A force that comes at once.

    Parameters
    ----------
    force : float
        The force [N].
    rise : float
        How long it takes to come [s].
    """

    force: Force
    rise: PositiveDuration = 1e-3

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        return (0.0, self.rise), (0.0, self.force)


@parameters
class RampLoad:
    """A force that grows evenly, as that of a motor or of what is poured into a vessel.

    Parameters
    ----------
    rate : float
        How fast it grows [N/s].
    force : float
        What it grows to [N].
    """

    rate: ForceRate
    force: Annotated[Force, pydantic.Field(gt=0)]

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        return (0.0, self.force / self.rate), (0.0, self.force)


@parameters
class DroppedBall:
    """A ball that falls into the object: a pulse in the form of half a sine, then its weight.

    Parameters
    ----------
    mass : float
        Mass of the ball [kg].
    height : float
        How deep it falls [m].
    contact_time : float
        How long the pulse lasts [s].
    """

    mass: Mass
    height: PositiveLength
    contact_time: PositiveDuration = 10e-3

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        shares = np.linspace(0.0, 1.0, _PULSE_KNOTS)
        pulse = np.sin(np.pi * shares)
        momentum = self.mass * np.sqrt(2.0 * GRAVITY * self.height)
        # Linear between its knots, the pulse has exactly the momentum of the ball.
        peak = momentum / (self.contact_time * np.mean(0.5 * (pulse[1:] + pulse[:-1])))
        forces = peak * pulse + self.mass * GRAVITY * shares
        return tuple((self.contact_time * shares).tolist()), tuple(forces.tolist())


@parameters
class LoadSeries:
    """A force that was recorded.

    Parameters
    ----------
    times : tuple of float
        Ascending times, the first 0 [s].
    forces : tuple of float
        The force at each [N].
    """

    times: tuple[Duration, ...]
    forces: tuple[Force, ...]

    def __post_init__(self) -> None:
        ascending = all(early < late for early, late in pairwise(self.times))
        if not self.times or len(self.times) != len(self.forces) or not ascending or self.times[0] != 0.0:
            fault = f"got {len(self.times)} times and {len(self.forces)} forces"
            raise InputError("times", fault, "needs ascending times from 0 s on, a force for each")

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        return self.times, self.forces


BuiltInLoad = StepLoad | RampLoad | DroppedBall | LoadSeries
#: A load as a parameter; files write ``ramp_load: {...}``.
LoadChoice = Annotated[
    BuiltInLoad,
    one_of(BuiltInLoad, "load", "LoadChoice", "A load, under the key that names its kind; exactly one is given."),
]


def load_ramp(load: Load, begins: float) -> Ramp:
    """Return the force [N] of a load that begins at a time [s]."""
    times, forces = load.series()
    return Ramp(tuple(begins + time for time in times), forces)
