"""The programme: how counterfaces move, one phase after the other; and factors over time."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np

from fingerslip.errors import InputError
from fingerslip.parameters import Duration, Length, PositiveDuration, PositiveLength, Speed, one_of, parameters


@parameters
class Ramp:
    """A factor over time: linear between given times, constant before the first and after the last.

    Examples
    --------
    >>> import fingerslip as fs
    >>> filling = fs.Ramp(times=(0.1, 0.6), factors=(0.0, 1.0))
    >>> [round(filling.at(time), 3) for time in (0.0, 0.2, 0.9)]
    [0.0, 0.2, 1.0]
    """

    times: Annotated[tuple[Duration, ...], "Ascending times [s]."]
    factors: Annotated[tuple[float, ...], "The factor at each [-]."]

    def __post_init__(self) -> None:
        ascending = all(early < late for early, late in pairwise(self.times))
        if not self.times or len(self.times) != len(self.factors) or not ascending:
            raise InputError(
                "times", f"got {self.times} and {self.factors}", "needs ascending times, a factor for each"
            )

    def at(self, time: float) -> float:
        """Return the factor at a time [s]."""
        return float(np.interp(time, self.times, self.factors))


#: The factor that is one at all times.
CONSTANT = Ramp((0.0,), (1.0,))


@parameters
class Press:
    """Move the counterfaces along their outward normals, towards the deformable body.

    Examples
    --------
    Press by 1.5 mm within a second, wait, slide by 6 mm towards -x and lift:

    >>> import fingerslip as fs
    >>> programme = (
    ...     fs.Press(depth=1.5e-3, speed=1.5e-3),
    ...     fs.Hold(duration=0.5),
    ...     fs.Slide(distance=6e-3, speed=3e-3, direction=(-1.0, 0.0)),
    ...     fs.Lift(distance=2e-3, speed=10e-3),
    ... )
    """

    depth: Annotated[PositiveLength, "Travel [m]."]
    speed: Annotated[Speed, "Speed [m/s]."]


@parameters
class Lift:
    """Move the counterfaces along their normals, away from the deformable body.

    See :class:`Press`.
    """

    distance: Annotated[PositiveLength, "Travel [m]."]
    speed: Annotated[Speed, "Speed [m/s]."]


@parameters
class Hold:
    """Keep the counterfaces where they are.

    See :class:`Press`.
    """

    duration: Annotated[PositiveDuration, "Duration [s]."]


@parameters
class Slide:
    """Move the counterfaces along their surfaces.

    See :class:`Press`.
    """

    distance: Annotated[PositiveLength, "Travel [m]."]
    speed: Annotated[Speed, "Speed [m/s]."]
    direction: Annotated[
        tuple[float, ...] | None,
        "Direction of the counterface's motion, of any length [-]; its part along the normal is left out. Without it "
        "the counterface moves along its tangent, +x for a plate below the body.",
    ] = None
    press: Annotated[
        Length, "Travel along the normals, towards the body, at the same time [m]; negative away from it."
    ] = 0.0


Phase = Press | Hold | Slide | Lift
_WORDS = "One phase of the programme, under the key that names its kind; exactly one is given."
#: A phase as a parameter; study files write ``press: {...}``.
ProgrammeEntry = Annotated[Phase, one_of(Phase, "phase", "ProgrammeEntry", _WORDS)]


def phase_travel(phase: Phase) -> float:
    """Return how far counterfaces move in a phase [m]."""
    match phase:
        case Press():
            return phase.depth
        case Slide() | Lift():
            return phase.distance
        case Hold():
            return 0.0


def phase_duration(phase: Phase) -> float:
    """Return how long a phase lasts [s]."""
    return phase.duration if isinstance(phase, Hold) else phase_travel(phase) / phase.speed
