"""The critical latency: the longest one that still saves the object, by bisection.

An object is saved or lost by when the grip begins to rise, whatever set it off. So one search serves all detectors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingerslip.react.loop import Grasp
from fingerslip.react.reflex import Reaction

_FIRST_STEP = 4.0  # in tolerances: how far from its guess a search looks first


@dataclass(frozen=True)
class CriticalStart:
    """The latest time since the load began at which the grip may begin to rise.

    Parameters
    ----------
    time : float or None
        That time [s]; None where not even a grip that rises with the load saves the object, infinite where none has to.
    error : float
        How much later it may be [s].
    runs : int
        How many reactions were computed.
    """

    time: float | None
    error: float
    runs: int

    def latency(self, grasp: Grasp, detector: str) -> float | None:
        """Return the critical latency after a detector's alarm [s], its delay taken off.

        None where it would be negative or nothing saves the object, infinite where it is not lost at all.
        """
        alarm = grasp.open_loop.alarms[detector]
        if grasp.open_loop.lost is None:
            return np.inf
        if self.time is None or alarm is None:
            return None
        latency = self.time - alarm.time - grasp.detectors[detector].delay
        return latency if latency >= 0.0 else None


def search_edge(
    saves: Callable[[float], bool], low: float, high: float, guess: float, tolerance: float
) -> tuple[float | None, float]:
    """Return the last number that is saved where all below it are, and how much larger it may be.

    Steps that double lead from a guess to a bracket, which is then halved. What is at `high` is not saved.
    """
    step, number = _FIRST_STEP * tolerance, min(max(guess, low), high)
    allowed = tolerance * (1.0 + 1e-6)
    saved, lost = None, high
    while saved is None or lost - saved > allowed:
        if number < high and saves(number):
            saved = number
        else:
            lost = number
            if number <= low:
                return None, 0.0
        is_bracketed = saved is not None and lost < high
        if is_bracketed or (saved is not None and saved + step >= high) or (saved is None and lost - step <= low):
            number = 0.5 * ((low if saved is None else saved) + lost)
            if saved is None and lost - low <= allowed:
                number = low
        else:
            number = lost - step if saved is None else saved + step
            step *= 2.0
    return saved, lost - saved


def critical_start(grasp: Grasp, reaction: Reaction, tolerance: float = 1e-3) -> CriticalStart:
    """Return the latest start of the grip that saves the object.

    Parameters
    ----------
    grasp : Grasp
        The object.
    reaction : Reaction
        How the grip rises; its latency and dead time do not matter.
    tolerance : float
        Largest error [s].

    Returns
    -------
    CriticalStart
        The time.
    """
    loop = grasp.open_loop
    if loop.lost is None:
        return CriticalStart(np.inf, 0.0, 0)
    # A good guess is the latest start that saves a rigid object which moves as in the open loop until then.
    low, high = 0, loop.times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _saves_rigid(grasp, reaction, middle) else (low, middle)
    starts: list[float] = []

    def saves(start: float) -> bool:
        starts.append(start)
        return grasp.saves(reaction.response(start, grasp.held.first_grip))

    time, error = search_edge(saves, 0.0, loop.lost, float(loop.times[low]), tolerance)
    return CriticalStart(time, error, len(starts))


def _saves_rigid(grasp: Grasp, reaction: Reaction, record: int) -> bool:
    """Tell whether a response that begins at a record of the open loop stops a rigid object in time."""
    held, loop = grasp.held, grasp.open_loop
    time, travel, speed = (float(values[record]) for values in (loop.times, loop.travel, loop.speed))
    response = reaction.response(time, held.first_grip)
    while travel <= held.travel_limit and time < held.duration:
        time += held.step
        excess = held.total_load(time) - 2.0 * held.friction * response.force(time)
        speed += held.step * excess / held.mass
        travel += held.step * speed
        if speed <= 0.0:
            return True
    return travel <= held.travel_limit
