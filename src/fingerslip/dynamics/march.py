"""The one loop over time: motions that share a matrix, step by step together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.outside import OutsideCheck
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.rotations import RotationCheck
from fingerslip.dynamics.step.sharing import first_alike, same_motion
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.step import advance
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.linear.threads import Mapper, side_by_side

__all__ = ["march"]

Array = NDArray[np.float64]
Inspect = Callable[[int, State], None]


def march(
    steppers: Sequence[Stepper],
    recorders: Sequence[Recorder],
    times: Sequence[Array],
    *,
    watch: Stopwatch,
    progress: Callable[[float], None] | None = None,
    threads: int = 1,
    inspect: Inspect | None = None,
) -> None:
    """Step through time and record every state of every motion.

    Parameters
    ----------
    steppers : sequence of Stepper
        One for each motion.
    recorders : sequence of Recorder
        Take the states of each.
    times : sequence of (n_times,) array
        Times of the steps of each, the start included [s]; equal but for their number.
    watch : Stopwatch
        Takes the times.
    progress : callable, optional
        Called after every step with the fraction that is done.
    threads : int, optional
        Threads that solve the contacts of different motions side by side.
    inspect : callable, optional
        Called with the number of a motion and each of its states.
    """
    counterfaces = [_displacements(stepper.system, check) for stepper, check in zip(steppers, times, strict=True)]
    alike = first_alike([stepper.system for stepper in steppers], same_motion)
    starts = {kind: first_state(steppers[kind]) for kind in set(alike)}
    states = [starts[kind] for kind in alike]
    for number, (recorder, state) in enumerate(zip(recorders, states, strict=True)):
        recorder.record(state)
        if inspect is not None:
            inspect(number, state)
    last = max(check.size for check in times) - 1
    outside = [OutsideCheck(stepper.system) for stepper in steppers]
    rotations = [RotationCheck(stepper.system) for stepper in steppers]
    with side_by_side(min(threads, len(steppers))) as mapper:
        for step in range(1, last + 1):
            moving = [number for number, check in enumerate(times) if step < check.size]
            shifts = {number: counterfaces[number][step] for number in moving}
            time = float(times[moving[0]][step])
            states = _advance_different(steppers, states, alike, shifts, time=time, watch=watch, mapper=mapper)
            with watch.part("recording"):
                for number in moving:
                    outside[number].look(states[number])
                    rotations[number].look(states[number])
                    recorders[number].record(states[number])
            if inspect is not None:
                for number in moving:
                    inspect(number, states[number])
            if progress is not None:
                progress(step / last)
    for check, turning in zip(outside, rotations, strict=True):
        check.finish()
        turning.finish()


def _advance_different(
    steppers: Sequence[Stepper],
    states: Sequence[State],
    alike: Sequence[int],
    shifts: dict[int, Array],
    *,
    time: float,
    watch: Stopwatch,
    mapper: Mapper,
) -> list[State]:
    """Return all states after one step of the motions in `shifts`; those that are still the same are computed once."""
    groups: dict[tuple[int, int, bytes], list[int]] = {}
    for number, shift in shifts.items():
        groups.setdefault((alike[number], id(states[number]), shift.tobytes()), []).append(number)
    first = [members[0] for members in groups.values()]
    advanced = advance(
        [steppers[number] for number in first],
        [states[number] for number in first],
        time,
        [shifts[number] for number in first],
        watch=watch,
        mapper=mapper,
    )
    after = {number: state for members, state in zip(groups.values(), advanced, strict=True) for number in members}
    return [after.get(number, state) for number, state in enumerate(states)]


def _displacements(system: System, times: Array) -> Array:
    """Return the displacement of every counterface at every time, shape (n_times, n_counterfaces, dim) [m]."""
    if not system.motions:
        return np.zeros((times.size, 0, system.space.dim))
    return np.stack([motion.displacement(times) for motion in system.motions], axis=1)
