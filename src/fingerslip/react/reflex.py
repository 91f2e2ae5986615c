"""What follows an alarm: a latency, a dead time, then a grip that rises at the rate of its actuator.

The grip force is a function of time in seconds; it may begin to rise inside a step of the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import Force, NonNegativeNumber, ShortDuration, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.units import Unit

ForceRate = Annotated[float, Unit("N/s"), pydantic.Field(gt=0)]
PositiveForce = Annotated[Force, pydantic.Field(gt=0)]

_ROUNDING = 1e-9


@parameters
class Reflex:
    """What an alarm sets off.

    Examples
    --------
    >>> import fingerslip as fs
    >>> reflex = fs.Reflex(latency=74e-3, jitter=9e-3)
    >>> f"{reflex.share_within(83e-3):.2f}"
    '0.84'
    """

    latency: Annotated[ShortDuration, "Time to the command [s]."] = 0.0
    since: Annotated[
        Literal["alarm", "load"],
        "From when it counts: the alarm of a detector, or the start of the load, as in experiments without a detector.",
    ] = "alarm"
    jitter: Annotated[ShortDuration, "Standard deviation of the latency from trial to trial [s]."] = 0.0
    gain: Annotated[NonNegativeNumber, "Grip force that is added, as a share of that at the alarm [-]."] = 1.0
    shape: Annotated[
        Literal["ramp", "smooth", "exponential"],
        "How the force rises: evenly, with a smooth start and end, or ever slower. "
        "None is ever faster than the actuator.",
    ] = "ramp"

    def share_within(self, latency: float) -> float:
        """Return the share of trials that are no later than a latency [s]; latencies are normally distributed."""
        if self.jitter == 0.0:
            return float(self.latency <= latency)
        return 0.5 * (1.0 + math.erf((latency - self.latency) / (math.sqrt(2.0) * self.jitter)))


def require_whole_step(where: str, latency: float, step: float) -> None:
    """Refuse a latency [s] that is shorter than a step [s], and not zero."""
    if 0.0 < latency < step:
        fault, allowed = f"got {latency:g} s", f"needs 0 s or at least a step, {step:g} s"
        raise InputError(where, fault, allowed, "take a shorter step")


@parameters
class Actuator:
    """What moves the fingers.

    Examples
    --------
    >>> import fingerslip as fs
    >>> slow = fs.Reaction(fs.Reflex(latency=74e-3), fs.Actuator(dead_time=20e-3, force_rate=10.0))
    >>> round(slow.delay, 3)
    0.094
    """

    dead_time: Annotated[ShortDuration, "Time from the command to the first change of the force [s]."] = 0.0
    force_rate: Annotated[ForceRate, "Largest rate of the grip force [N/s]."] = 20.0
    largest_force: Annotated[PositiveForce, "Largest grip force [N]."] = 40.0
    update_period: Annotated[
        ShortDuration, "Time between changes of the force [s]; 0 for one that changes continuously."
    ] = 0.0


@parameters
class Reaction:
    """A reflex and the actuator that it drives.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.reaction("human-slip").delay
    0.074
    """

    reflex: Annotated[Reflex, "What an alarm sets off."] = Reflex()
    actuator: Annotated[Actuator, "What moves the fingers."] = Actuator()

    @property
    def delay(self) -> float:
        """Time from the alarm to the first change of the force [s]."""
        return self.reflex.latency + self.actuator.dead_time

    def response(self, start: float, grip: float) -> Response:
        """Return the grip force over time: a first force [N] until it begins to rise at `start` [s].

        An InputError refuses an actuator that cannot even hold that force.
        """
        if self.actuator.largest_force < grip:
            fault, allowed = f"got {self.actuator.largest_force:.4g} N", f"needs at least the grip force, {grip:.4g} N"
            raise InputError("actuator.largest_force", fault, allowed)
        return Response(start, grip, self.reflex, self.actuator)


@dataclass(frozen=True)
class Response:
    """The grip force over time that a reaction brings."""

    start: float  # when it begins to rise [s]
    grip: float  # until then [N]
    reflex: Reflex
    actuator: Actuator

    @property
    def addition(self) -> float:
        """Force that is added in the end [N]."""
        return min(self.reflex.gain * self.grip, self.actuator.largest_force - self.grip)

    def force(self, time: float) -> float:
        """Return the grip force at a time [s], in N."""
        since, period = time - self.start, self.actuator.update_period
        if since <= 0.0 or self.addition <= 0.0:
            return self.grip
        if period > 0.0:
            since = math.floor(since / period + _ROUNDING) * period
        # Time over the shortest one that the actuator needs for all that is added: no share of it grows faster.
        progress = since * self.actuator.force_rate / self.addition
        if self.reflex.shape == "ramp":
            share = min(progress, 1.0)
        elif self.reflex.shape == "smooth":
            way = min(progress / 1.5, 1.0)  # as the slope of 3 s^2 - 2 s^3 is at most 3/2
            share = way * way * (3.0 - 2.0 * way)
        else:
            share = -math.expm1(-progress)
        return self.grip + self.addition * share


#: Reactions that ship, every value with its source.
REACTIONS = Presets(Reaction, "fingerslip.react")


def reaction_names() -> tuple[str, ...]:
    """Return the names of the reactions that ship, of people, robots and a prosthesis.

    Examples
    --------
    >>> import fingerslip as fs
    >>> [name for name in fs.reaction_names() if name.startswith("human")]
    ['human-load', 'human-skin', 'human-slip']
    """
    return REACTIONS.names


def reaction(name: str) -> Reaction:
    """Return a reaction that ships.

    Parameters
    ----------
    name : str
        Its name, one of :func:`reaction_names`.

    Returns
    -------
    Reaction
        Its reflex and actuator. What is not published, above all rates of force, is assumed; the page of a
        study with the block `reaction` has the source of every value.

    Raises
    ------
    InputError
        Where there is none of that name.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.reaction("prosthesis").reflex.latency
    0.3
    """
    return REACTIONS.read(name)
