"""A run of a study with the block `reaction`: the search for the critical latency, reactions, and their film.

The critical latency is the longest one that still saves the object, by bisection. An object is saved or lost by when
the grip begins to rise, whatever set it off. So one search serves all detectors.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import numpy as np

from fingerslip.dynamics.reduced.basis import BasisStore
from fingerslip.libraries import xr
from fingerslip.model.model import Model
from fingerslip.parameters.words import describe_fields
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp, MemoryBases
from fingerslip.react.reflex import Reaction
from fingerslip.react.results import FILM, STILL, ReactionResult, Trial, write_reactions
from fingerslip.react.scenario import HeldObject
from fingerslip.react.settings import ReactionSettings
from fingerslip.storage.files import write_bytes

_FIRST_STEP = 4.0  # in tolerances: how far from its guess a search looks first


@describe_fields
@dataclass(frozen=True)
class CriticalStart:
    """The latest time since the load began at which the grip may begin to rise.

    See :class:`Grasp`.
    """

    time: Annotated[
        float | None,
        "That time [s]; None where not even a grip that rises with the load saves the object, infinite where none has "
        "to.",
    ]
    error: Annotated[float, "How much later it may be [s]."]
    runs: Annotated[int, "How many reactions were computed."]

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

    See :class:`Grasp`.

    Parameters
    ----------
    grasp : Grasp
        The object.
    reaction : Reaction
        How the grip rises; its latency and dead time do not matter.
    tolerance : float
        Largest error [s].
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
        return grasp.branch(reaction.response(start, grasp.held.first_grip), earliest=start).saved

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


def compute_reactions(
    settings: ReactionSettings,
    held: HeldObject,
    model: Model,
    folder: Path,
    *,
    bases: BasisStore,
    progress: Callable[[float], None],
) -> xr.Dataset:
    """Compute a run, write what comes of its reactions into its folder, and return the history without a reaction."""
    with Grasp(held, model, settings.detectors, bases=MemoryBases(bases)) as grasp:
        result = _result(settings, grasp, progress)
        write_reactions(result, folder)
        tried = [trial for trial in result.trials if trial.detector == settings.detector and not trial.since_load]
        ordered = sorted(tried, key=lambda trial: trial.delay)
        saved, lost = ([trial for trial in ordered if trial.saved is kind] for kind in (True, False))
        # The slowest reaction that saves the object, and the quickest that loses it, by title.
        filmed = {
            f"{trial.reaction}, {1e3 * trial.delay:.0f} ms": settings.named_reactions[trial.reaction]
            for trial in (*saved[-1:], *lost[:1])
        }
        # A film shows sections; OpenCV, of the extra `vision`, writes it.
        if len(filmed) == 2 and settings.reactions and model.mesh.dim() == 2 and find_spec("cv2"):
            from fingerslip.react.film import write_film

            write_bytes(folder / STILL, write_film(folder / FILM, grasp, settings.detector, filmed))
        return grasp.open_loop.history


def _result(settings: ReactionSettings, grasp: Grasp, progress: Callable[[float], None]) -> ReactionResult:
    held, loop = grasp.held, grasp.open_loop

    @functools.cache
    def critical_of(rise: Reaction) -> CriticalStart:
        return critical_start(grasp, rise, settings.tolerance)

    critical, trials, travels = critical_of(_with_delay(settings.rise, 0.0)), list[Trial](), dict[float, float]()
    steps = 1 + len(settings.named_reactions) + len(settings.latencies)
    for number, (name, reaction) in enumerate(settings.named_reactions.items(), start=1):
        progress(number / steps)
        trials += _trials(name, reaction, grasp, critical_of(_with_delay(reaction, 0.0)))
    for number, latency in enumerate(settings.latencies, start=1 + len(settings.named_reactions)):
        progress(number / steps)
        travels[latency] = grasp.react(_with_delay(settings.rise, latency), settings.detector).travel
    return ReactionResult(
        friction=held.friction,
        load_rate=held.load.rate if isinstance(held.load, RampLoad) else None,
        grip=held.first_grip,
        alarms={name: None if alarm is None else alarm.time for name, alarm in loop.alarms.items()},
        gross=loop.gross,
        lost=loop.lost,
        critical={name: _finite(critical.latency(grasp, name)) for name in settings.detectors},
        error=critical.error,
        trials=tuple(trials),
        travels=travels,
    )


def _trials(name: str, reaction: Reaction, grasp: Grasp, critical: CriticalStart) -> list[Trial]:
    """Try a reaction after every detector."""
    trials, since_load = [], reaction.reflex.since == "load"
    for detector in grasp.detectors:
        longest = _finite(critical.time if since_load else critical.latency(grasp, detector))
        outcome = grasp.react(reaction, detector)
        trials.append(
            Trial(
                reaction=name,
                detector=detector,
                delay=reaction.delay,
                since_load=since_load,
                force_rate=reaction.actuator.force_rate,
                critical=longest,
                chance=None if longest is None else reaction.reflex.share_within(longest - reaction.actuator.dead_time),
                saved=outcome.saved,
                travel=outcome.travel,
                slip=outcome.largest_slip,
                grip_added=outcome.grip_added,
                false_grip=outcome.false_grip,
            )
        )
    return trials


def _finite(time: float | None) -> float | None:
    return None if time is None or np.isinf(time) else time


def _with_delay(reaction: Reaction, delay: float) -> Reaction:
    """Return a reaction that changes the force a time after the alarm [s], the same in all trials."""
    reflex = replace(reaction.reflex, latency=delay, jitter=0.0, since="alarm")
    return Reaction(reflex, replace(reaction.actuator, dead_time=0.0))
