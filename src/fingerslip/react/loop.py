"""The loop: an object is held, its load grows, something notices, the grip rises, the object is saved or lost.

What happens before the grip rises is the same for all reactions. It is computed once, with no reaction at all, and
saved at every alarm. A reaction is a branch that is restored there; to the last bit it is what a run of its own gives.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr

from fingerslip.arrays import Floats
from fingerslip.dynamics.reduced.basis import BasisStore
from fingerslip.dynamics.steering.commands import Command
from fingerslip.dynamics.steering.steering import Observation, Simulation
from fingerslip.errors import InputError
from fingerslip.model.model import Model
from fingerslip.parameters.words import describe_fields
from fingerslip.react.moment import Alarm, Detector, Moment, require_sites
from fingerslip.react.reflex import Reaction, Response, require_whole_step
from fingerslip.react.scenario import HeldObject, held_model

_LOOKS_AHEAD = 64  # times at which a load between its knots and a grip are compared


class MemoryBases:
    """Reduced bases that are kept in memory, for all runs on one mesh, and in a store on disk, if there is one."""

    def __init__(self, store: BasisStore | None = None) -> None:
        self._store, self._arrays = store, dict[str, Mapping[str, Floats]]()

    def load(self, key: str) -> Mapping[str, Floats] | None:
        """Return the arrays of a key, or None."""
        if key not in self._arrays and self._store is not None:
            arrays = self._store.load(key)
            self._arrays |= {} if arrays is None else {key: arrays}
        return self._arrays.get(key)

    def save(self, key: str, arrays: Mapping[str, Floats]) -> None:
        """Keep arrays under a key."""
        self._arrays[key] = arrays
        if self._store is not None:
            self._store.save(key, arrays)

    def alone(self, key: str) -> AbstractContextManager[None]:
        """Keep other processes from making the arrays of a key in a block, where they share the store."""
        if self._store is not None and key not in self._arrays:
            return self._store.alone(key)
        return contextlib.nullcontext()


@describe_fields
@dataclass(frozen=True)
class OpenLoop:
    """What happens where nothing reacts.

    See :class:`Grasp`.
    """

    times: Annotated[Floats, "(n,) array : Times since the load began [s]."]
    travel: Annotated[Floats, "(n,) array : Travel of the object along the load [m]."]
    speed: Annotated[Floats, "(n,) array : Its speed along the load [m/s]."]
    slipped: Annotated[Floats, "(n,) array : Share of the contact area that has slipped [-]."]
    alarms: Annotated[Mapping[str, Alarm | None], "What each detector says; None where it says nothing."]
    gross: Annotated[float | None, "From when on nothing sticks, up to the loss [s]."]
    lost: Annotated[float | None, "When the travel exceeds its limit [s]."]
    history: Annotated[xr.Dataset, "All that was recorded."]

    def lead(self, name: str) -> float | None:
        """Return the time from a detector's alarm to gross slip [s]; None where one of them is."""
        alarm = self.alarms[name]
        return None if alarm is None or self.gross is None else self.gross - alarm.time


@describe_fields
@dataclass(frozen=True)
class Outcome:
    """What comes of a reaction.

    See :class:`Grasp`.
    """

    saved: Annotated[bool, "Whether the travel stayed within its limit."]
    travel: Annotated[
        float,
        "Largest travel of the object since the load began, elastic shear of the skin included [m].",
    ]
    largest_slip: Annotated[float, "Largest slip of a node since the load began [m]."]
    grip: Annotated[float, "Largest grip force [N]."]
    grip_added: Annotated[float, "What of it the reaction added [N]."]
    false_grip: Annotated[bool, "Whether the grip rose for an object that would have been held without it."]
    start: Annotated[float | None, "When the grip began to rise, since the load began [s]; None without a reaction."]
    end: Annotated[float, "When it was decided, since the load began [s]."]
    times: Annotated[Floats, "(n,) array : Times since the load began, from the branch on [s]."] = field(repr=False)
    travels: Annotated[Floats, "(n,) array : The travel at these times [m]."] = field(repr=False)


class Grasp:
    """An object that is held, with detectors that watch it.

    Parameters
    ----------
    held : HeldObject
        The object and its load.
    holder : Model
        What holds it, as :func:`holder_of` makes it.
    detectors : mapping of str to Detector
        The detectors, by name.
    bases : BasisStore, optional
        Where reduced bases are kept.

    Examples
    --------
    A reflex of 74 ms, from the time at which people notice slip, of a block of pulp that holds 100 g:

    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().refined(1).scaled(10e-3).with_defaults()
    >>> holder = fs.Model(
    ...     mesh=block.with_subdomains({"pulp": lambda x: x[0] > 0.0}),
    ...     materials={"pulp": fs.material("pulp")},
    ...     formulation="plane_strain",
    ...     depth=12e-3,
    ...     supports={"top": ("x", "y")},
    ...     contacts=(fs.Contact("bottom"),),
    ...     time=fs.TimeStepping(step=5e-3, end=1.0),
    ... )
    >>> held = fs.HeldObject(mass=0.1, friction=0.6, margin=0.45, load=fs.RampLoad(rate=4.0, force=1.0), step=5e-3)
    >>> with fs.Grasp(held, holder, {"people": fs.SlippedArea(0.48)}) as grasp:
    ...     alarm = grasp.open_loop.alarms["people"]
    ...     outcome = grasp.react(fs.reaction("human-slip"), "people")
    ...     latest = fs.critical_start(grasp, fs.reaction("human-slip"), tolerance=5e-3)
    >>> f"noticed at {alarm.time:.3f} s, grip rises at {outcome.start:.3f} s, saved: {outcome.saved}"
    'noticed at 0.035 s, grip rises at 0.109 s, saved: True'
    >>> f"{latest.latency(grasp, 'people'):.2f} s would do"
    '0.12 s would do'
    """

    def __init__(
        self,
        held: HeldObject,
        holder: Model,
        detectors: Mapping[str, Detector],
        *,
        bases: MemoryBases | None = None,
    ) -> None:
        self.held, self.detectors = held, dict(detectors)
        require_sites(self.detectors, holder)
        self.model = held_model(held, holder)
        self._bases = bases or MemoryBases()
        self._folder = tempfile.TemporaryDirectory(prefix="fingerslip-react-")
        self._saved: list[tuple[float, Path]] = []

    def __enter__(self) -> Grasp:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    @cached_property
    def open_loop(self) -> OpenLoop:
        """What happens where nothing reacts."""
        with Simulation(self.model, threads=1, bases=self._bases) as simulation:
            return self._watch(simulation)

    def react(self, reaction: Reaction, detector: str) -> Outcome:
        """Return what comes of a reaction to the alarm of a detector, by name: saved or lost, and at what price.

        Its latency counts from the alarm; without one that is what happens without a reaction. An InputError refuses a
        detector that is not there, a latency shorter than a step, and an actuator that cannot hold the grip.
        """
        return self.branch(self.response_to(reaction, detector))

    def response_to(self, reaction: Reaction, detector: str) -> Response | None:
        """Return the grip force over time that a reaction to a detector's alarm brings; None without an alarm."""
        if detector not in self.detectors:
            raise InputError("detector", f"got '{detector}'", f"needs one of {', '.join(self.detectors)}")
        require_whole_step("reflex.latency", reaction.reflex.latency, self.held.step)
        start = reaction.delay
        if reaction.reflex.since == "alarm":
            alarm = self.open_loop.alarms[detector]
            if alarm is None:
                return None
            start = alarm.time + self.detectors[detector].delay + reaction.delay
        return reaction.response(start, self.held.first_grip)

    def _outcome(self, times: Floats, travels: Floats, slip: float, grip: float, start: float | None) -> Outcome:
        """Return what comes of a grip that rose to a force [N] from a time on [s], by travels [m] over times [s]."""
        return Outcome(
            saved=bool(travels[-1] <= self.held.travel_limit),
            travel=float(travels.max()),
            largest_slip=slip,
            grip=grip,
            grip_added=grip - self.held.first_grip,
            false_grip=start is not None and self.open_loop.lost is None,
            start=start,
            end=float(times[-1]),
            times=times,
            travels=travels,
        )

    def branch(self, response: Response | None, earliest: float | None = None) -> Outcome:
        """Return what comes of a response that begins with the load or later, or of none, from the last saved state on.

        It is decided not before the load has come, or an earlier time since the load began [s], which is quicker.
        """
        loop, load_end = self.open_loop, self.held.load.series()[0][-1]
        if response is None or (loop.lost is not None and response.start >= loop.lost):
            return self._outcome(loop.times, loop.travel, self._open_slip, self.held.first_grip, None)
        earlier = [path for time, path in self._saved if time <= response.start]
        if not earlier:
            raise InputError("response.start", f"got {response.start:.4g} s", "needs 0 s or more since the load began")
        with Simulation.restore(earlier[-1], self.model, threads=1, bases=self._bases) as simulation:
            return self._follow(simulation, response, load_end if earliest is None else earliest)

    def history(self, response: Response | None, *, snapshots_every: float = 0.0) -> xr.Dataset:
        """Return the whole history of a response, or of none, up to its decision: for films and figures.

        Snapshots of the whole mesh are as far apart as is wanted [s]; there are none without.
        """
        model = replace(self.model, record=replace(self.model.record, snapshots_every=snapshots_every))
        with Simulation(model, threads=1, bases=self._bases) as simulation:
            last = self.branch(response).end + self.held.begins
            while simulation.time < last - 0.5 * self.held.step:
                self._step(simulation, response)
            return simulation.history()

    def _step(self, simulation: Simulation, response: Response | None) -> Observation:
        """Take a step under the force that a response has at its end."""
        time = simulation.time + self.held.step - self.held.begins
        if response is None or time <= response.start:
            return simulation.step()
        added = response.force(time) - self.held.first_grip
        return simulation.step(Command(self.held.gripped, force=(0.0, added, 0.0)[: self.model.mesh.dim()]))

    def _motion(self, observation: Observation) -> tuple[float, float]:
        """Return position [m] and speed [m/s] of the object along the load."""
        position, speed = (observation[f"rigid_body_{name}"][0, 0] for name in ("displacement", "velocity"))
        return self.held.direction * float(position), self.held.direction * float(speed)

    def _watch(self, simulation: Simulation) -> OpenLoop:
        """Take steps up to the loss, or the end; save a state at every alarm."""
        held = self.held
        for _ in range(round(held.begins / held.step)):
            observation = simulation.step()
        history = simulation.history()
        # What a plate on the other side does is no concern of a detector.
        self._skin = history["contact_counterface"].values == 0
        areas = np.where(self._skin, history["contact_area"].values, 0.0)
        slips = self._first_slips = observation["slip_distance"].copy()
        self._origin = self._motion(observation)[0]
        self._save(simulation, 0.0)
        alarms: dict[str, Alarm | None] = dict.fromkeys(self.detectors)
        watches = {name: detector.start() for name, detector in self.detectors.items()}
        rows: list[tuple[float, float, float, float, bool]] = []
        while True:
            moment = Moment(simulation.time - held.begins, observation, areas, slips)
            position, speed = self._motion(observation)
            rows.append(
                (moment.time, position - self._origin, speed, moment.slipped_fraction(), moment.stick_ratio == 0.0)
            )
            for name, watch in watches.items():
                if alarms[name] is None and (alarm := watch.take(moment)) is not None:
                    alarms[name] = alarm
                    self._save(simulation, moment.time)
            if simulation.is_finished or rows[-1][1] > held.travel_limit:
                break
            observation = simulation.step()
        self._open_slip = float((observation["slip_distance"] - slips)[self._skin].max())
        times, travel, speeds, slipped, slides = np.array(rows).T
        lost = float(times[-1]) if travel[-1] > held.travel_limit else None
        sticking = np.flatnonzero(slides == 0.0)
        first = int(sticking[-1]) + 1 if sticking.size else 0
        gross = float(times[first]) if lost is not None and first < times.size else None
        return OpenLoop(times, travel, speeds, slipped, alarms, gross, lost, simulation.history())

    def _save(self, simulation: Simulation, time: float) -> None:
        if not self._saved or self._saved[-1][0] < time:
            self._saved.append((time, Path(self._folder.name) / f"{len(self._saved)}"))
            simulation.save(self._saved[-1][1])

    def _follow(self, simulation: Simulation, response: Response, earliest: float) -> Outcome:
        """Take steps under a response until the object is lost, or saved at a time or later [s]."""
        held, times, travels = self.held, list[float](), list[float]()
        observation, grip = simulation.observation, response.grip
        while not simulation.is_finished:
            observation = self._step(simulation, response)
            time = simulation.time - held.begins
            position, speed = self._motion(observation)
            grip = max(grip, response.force(time))
            times.append(time)
            travels.append(position - self._origin)
            if travels[-1] > held.travel_limit:
                break
            if time >= max(earliest, response.start) and speed <= 0.0:
                # Whether friction bears the load now and ever after.
                later = np.linspace(time, max(held.duration, time), _LOOKS_AHEAD).tolist()
                later += [knot for knot in held.load.series()[0] if knot > time]
                if all(2.0 * held.friction * response.force(moment) > held.total_load(moment) for moment in later):
                    break
        slip = float((observation["slip_distance"] - self._first_slips)[self._skin].max())
        return self._outcome(np.array(times), np.array(travels), slip, grip, response.start)
