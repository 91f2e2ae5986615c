"""Held objects as environments of Gymnasium (extra `gym`): a controller senses the skin and sets the rate of the grip.

Importing this module registers `fingerslip/HoldFinger2D-v0` and `fingerslip/HoldTacTip2D-v0`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

try:
    import gymnasium
    from gymnasium import spaces
except ModuleNotFoundError as error:
    needs = 'fingerslip.environment: gymnasium is missing, environments need it; pip install "fingerslip[gym]"'
    raise ModuleNotFoundError(needs) from error

from fingerslip.afferents.model import AFFERENTS
from fingerslip.arrays import Singles
from fingerslip.contact.states import OPEN
from fingerslip.dynamics.steering.commands import Command
from fingerslip.dynamics.steering.steering import Observation, Simulation
from fingerslip.errors import InputError
from fingerslip.model.model import Contact, Model
from fingerslip.parameters import Duration, NonNegativeNumber, PositiveDuration, parameters
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import MemoryBases
from fingerslip.react.moment import Moment
from fingerslip.react.reflex import ForceRate
from fingerslip.react.scenario import HeldObject, held_model, holder_of
from fingerslip.react.spikes import SpikeStream, stimulus_of
from fingerslip.report.colours import BLACK, BLUE, VERMILLION
from fingerslip.report.figures.style import pixels, with_style
from fingerslip.sites import ReceptorKind
from fingerslip.specimens.fingertip.fingertip import MeshSizes, preset
from fingerslip.specimens.tactip.tactip import PRESETS as SENSORS
from fingerslip.specimens.tactip.tactip import SensorSectionSizes
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.running.build import build_model

__all__ = ["HoldEnv"]

Sensed = dict[str, NDArray[Any]]

_KINDS: tuple[ReceptorKind, ...] = ("FA-I", "SA-I")
_SENSOR, _SENSOR_SIZES = "tactip-ridged-2d", SensorSectionSizes(contact_size=0.4e-3, bulk_size=1.5e-3)
_SENSOR_SKIN = Contact("contact", normal_penalty=5e9, tangential_penalty=5e9)
_LARGEST_GRIP, _REACH = 10.0, {"finger": 8e-3, "tactip": 12e-3}  # [N]; [m], what may touch at that grip
_FAR, _MOST_SPIKES = 100.0, 100_000  # [mm] and [N]; bounds of what is sensed
_LOSS = 10.0  # what a loss costs, in mm of slip
_BASES = MemoryBases()
_FINGER_SIZES = MeshSizes(contact_size=0.15e-3, bulk_size=0.5e-3)
_HELD = HeldObject(mass=0.1, load=RampLoad(rate=4.0, force=1.0), step=2e-3)
_FRICTIONS, _LOAD_RATES = (0.3, 0.9), (1.0, 32.0)  # [-] and [N/s], between which tasks are drawn
_SPECIMENS = {"finger": "fingertip", "tactip": "tactip"}


@parameters
class Control:
    """How a controller acts: what holds, time from action to action, to its effect [s], and the largest rate [N/s]."""

    body: Literal["finger", "tactip"]
    control_period: PositiveDuration
    latency: Duration
    force_rate: ForceRate


@parameters
class Task:
    """What is held: friction coefficient, rate of the load [N/s], and the latency of the grip [s]."""

    friction: NonNegativeNumber
    load_rate: ForceRate
    latency: Duration


@dataclass(frozen=True)
class Domain:
    """Objects that are held, and the body that holds them."""

    held: HeldObject
    holder: Model
    frictions: tuple[float, float]  # smallest and largest [-]
    load_rates: tuple[float, float]  # smallest and largest [N/s]

    @classmethod
    def of(cls, body: str, study: str | Path | None) -> Domain:
        """Return what a study has, or what is held without one."""
        if study is None:
            if body == "finger":
                holder = holder_of(preset("wang2014-2d"), _FINGER_SIZES, groups=_KINDS)
            else:
                sensor = SENSORS.read(_SENSOR)
                holder = holder_of(
                    sensor, _SENSOR_SIZES, contact=_SENSOR_SKIN, depth=20e-3, groups=["internal_markers"]
                )
            return cls(_HELD, holder, _FRICTIONS, _LOAD_RATES)
        runs = read_runs(study).runs
        objects = [run.study.held_object for run in runs]
        ramps = [held.load for held in objects if held is not None and isinstance(held.load, RampLoad)]
        if objects[0] is None or len(ramps) < len(runs) or runs[0].study.specimen_kind != _SPECIMENS[body]:
            allowed = f"needs a {_SPECIMENS[body]}, and the block reaction with a ramp_load in all runs"
            raise InputError(str(study), "is of another kind", allowed, "take studies/reaction_map.yaml")
        frictions = sorted(held.friction for held in objects if held is not None)
        rates = sorted(ramp.rate for ramp in ramps)
        recorded: dict[str, Any] = {"receptors": _KINDS} if body == "finger" else {"groups": ("internal_markers",)}
        record = replace(runs[0].study.record, **{"receptors": (), "groups": (), **recorded})
        holder = build_model(replace(runs[0], study=replace(runs[0].study, record=record)))
        return cls(objects[0], holder, (frictions[0], frictions[-1]), (rates[0], rates[-1]))


class HoldEnv(gymnasium.Env[Sensed, Singles]):
    """Hold an object whose load grows, with as little grip as it takes.

    The action is the rate of the grip force, -1 to 1 of `force_rate`; it takes effect after the latency, to the
    microsecond, and then lasts as long as a control period. What is sensed:

    - `markers` : (n, 2), displacement of points of the skin, of a TacTip of its pins, since the load began [mm]
    - `mask` : (n,), which of them can be seen: those that touch the object, of a TacTip all
    - `taxels` : (k, 6), displacement [mm] and force [N] of the skin's contact nodes along x, y and z
    - `spikes` : (2,), spikes of FA-I and SA-I afferents in the last period; not of a TacTip
    - `grip` : (1,), grip force [N]

    A reward is minus the slip of the last period in mm, minus the share of the first grip that was added times the
    period in seconds, and -10 for the loss, which ends the episode. `info` has the truth, without NaN.

    Parameters
    ----------
    body : {'finger', 'tactip'}
        What holds the object, against its mirror image.
    study : path, optional
        A study with the block `reaction`: object and body are those of its first run; friction and rate of the load are
        drawn between the smallest and largest of its runs, the rate on a logarithmic scale.
    control_period : float
        Time from action to action, whole time steps [s].
    latency : float
        Time from an action to its effect [s].
    force_rate : float
        Largest rate of the grip force [N/s].
    render_mode : {'rgb_array'}, optional
        Whether :meth:`render` draws forces and travel so far.

    Examples
    --------
    ::

        import gymnasium, fingerslip.environment
        env = gymnasium.make("fingerslip/HoldFinger2D-v0", latency=0.074)
        seen, info = env.reset(seed=1, options={"friction": 0.6, "load_rate": 4.0})
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  as Gymnasium wants it

    def __init__(
        self,
        body: Literal["finger", "tactip"] = "finger",
        *,
        study: str | Path | None = None,
        control_period: float = 10e-3,
        latency: float = 0.0,
        force_rate: float = 50.0,
        render_mode: str | None = None,
    ) -> None:
        control = Control(body=body, control_period=control_period, latency=latency, force_rate=force_rate)
        self._domain = Domain.of(body, study)
        step = self._domain.held.step
        self._steps = round(control_period / step)
        if self._steps < 1 or abs(self._steps * step - control_period) > 1e-9:
            allowed = f"needs whole steps of {step:g} s"
            raise InputError("control_period", f"got {control_period:g} s", allowed)
        self.render_mode, self._force_rate, self._latency = render_mode, control.force_rate, control.latency
        self._kinds = _KINDS if body == "finger" else ()
        holder = self._domain.holder
        # A controller may squeeze as hard as it can: more of the skin touches than in a map.
        contact = replace(holder.contacts[0], search_distance=_REACH[body])
        self._holder = replace(holder, contacts=(contact,))
        self._simulation: Simulation | None = None
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        with Simulation(held_model(self._domain.held, self._holder), threads=1, bases=_BASES) as simulation:
            nodes = int((simulation.history()["contact_counterface"].values == 0).sum())
        markers = nodes if self._kinds else len(self._holder.record.sites)
        space: dict[str, spaces.Space[Any]] = {
            "markers": spaces.Box(-_FAR, _FAR, (markers, 2), np.float32),
            "mask": spaces.MultiBinary(markers),
            "taxels": spaces.Box(-_FAR, _FAR, (nodes, 6), np.float32),
            "grip": spaces.Box(0.0, _LARGEST_GRIP, (1,), np.float32),
        }
        if self._kinds:
            space["spikes"] = spaces.Box(0, _MOST_SPIKES, (len(self._kinds),), np.int32)
        self.observation_space = spaces.Dict(space)  # type: ignore[assignment]

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Sensed, dict[str, Any]]:
        """Hold another object: `friction`, `load_rate` [N/s] and `latency` [s] may be given, or are drawn."""
        super().reset(seed=seed)
        self.close()
        rates = np.log(self._domain.load_rates)
        drawn = {
            "friction": self.np_random.uniform(*self._domain.frictions),
            "load_rate": float(np.exp(self.np_random.uniform(*rates))),
            "latency": self._latency,
        }
        task = self._task = Task(**{**drawn, **(options or {})})
        held = self._domain.held
        load = RampLoad(task.load_rate, held.load.series()[1][-1])
        self._held = replace(held, friction=task.friction, load=load)
        simulation = self._simulation = Simulation(held_model(self._held, self._holder), threads=1, bases=_BASES)
        for _ in range(round(self._held.begins / self._held.step)):
            seen = simulation.step()
        self._first = {name: seen[name].copy() for name in ("contact_displacement", "slip_distance", "displacement")}
        history = simulation.history()
        # A controller feels nothing of a plate on the other side.
        self._skin = history["contact_counterface"].values == 0
        self._areas = np.where(self._skin, history["contact_area"].values, 0.0)
        self._start = float(seen["rigid_body_displacement"][0, 0])
        self._streams = {
            kind: SpikeStream(AFFERENTS.read(kind.lower()), 0.0, stimulus_of(seen, kind)) for kind in self._kinds
        }
        # Knots of the grip force that was asked for, over the times of the actions.
        self._times, self._grips, self._travels = [0.0], [self._held.first_grip], [(0.0, 0.0)]
        return self._senses(seen, [0] * len(self._kinds)), self._info(seen)

    def _grip(self, time: float) -> float:
        """Return the grip force [N] at a time since the load began [s]."""
        return float(np.interp(time - self._task.latency, self._times, self._grips))

    def step(self, action: Singles) -> tuple[Sensed, float, bool, bool, dict[str, Any]]:
        """Change the grip, and go on for a control period."""
        if self._simulation is None:
            raise InputError("environment", "has no object", "needs one", "call reset() first")
        held, period = self._held, self._steps * self._held.step
        rate = self._force_rate * float(np.clip(action, -1.0, 1.0)[0])
        self._times.append(self._times[-1] + period)
        self._grips.append(float(np.clip(self._grips[-1] + rate * period, 0.0, _LARGEST_GRIP)))
        counts, before = [0] * len(self._kinds), self._travels[-1][1]
        for _ in range(self._steps):
            time = self._simulation.time + held.step - held.begins
            seen = self._simulation.step(Command(held.gripped, force=(0.0, self._grip(time) - held.first_grip)))
            for number, (kind, stream) in enumerate(self._streams.items()):
                counts[number] += len(stream.advance(time, stimulus_of(seen, kind)))
            self._travels.append((time, self._travel(seen)))
            is_lost = self._travels[-1][1] > held.travel_limit
            if is_lost or self._simulation.is_finished:
                break
        added = self._grip(time) / held.first_grip - 1.0
        reward = -1e3 * abs(self._travels[-1][1] - before) - max(added, 0.0) * period - _LOSS * is_lost
        is_over = self._simulation.is_finished and not is_lost
        return self._senses(seen, counts), reward, is_lost, is_over, self._info(seen)

    def _travel(self, seen: Observation) -> float:
        """Return how far the object is from where it was when the load began [m]."""
        return self._held.direction * (float(seen["rigid_body_displacement"][0, 0]) - self._start)

    def _senses(self, seen: Observation, counts: list[int]) -> Sensed:
        """Return what the controller senses."""
        skin, areas = self._skin, self._areas[self._skin]
        moved = 1e3 * (seen["contact_displacement"] - self._first["contact_displacement"])[skin]
        forces = seen["tangential_traction"][skin] * areas[:, None]
        forces[:, 1] += seen["normal_traction"][skin] * areas
        flat = np.zeros((len(moved), 1))
        pins = 1e3 * (seen["displacement"] - self._first["displacement"])
        touching = (seen["contact_state"][skin] != OPEN).astype(np.int8)
        values: Sensed = {
            "markers": moved if self._kinds else pins,
            "mask": touching if self._kinds else np.ones(len(pins), np.int8),
            "taxels": np.hstack([moved, flat, forces, flat]),
            "grip": np.array([self._grips[0] if len(self._times) == 1 else self._grip(self._travels[-1][0])]),
        }
        for name in ("markers", "taxels", "grip"):
            box = self.observation_space[name]  # type: ignore[index]
            values[name] = np.clip(values[name], box.low, box.high).astype(np.float32)
        return {**values, "spikes": np.array(counts, np.int32)} if self._kinds else values

    def _info(self, seen: Observation) -> dict[str, Any]:
        """Return the truth."""
        moment = Moment(self._travels[-1][0], seen, self._areas, self._first["slip_distance"])
        return {
            **asdict(self._task),
            "time": moment.time,
            "load": self._held.total_load(moment.time),
            "travel": self._travels[-1][1],
            "slipped_fraction": moment.slipped_fraction(),
            "stick_ratio": moment.stick_ratio,
        }

    @with_style
    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return a picture (height, width, 3) of load, what friction bears and travel so far, in mode 'rgb_array'."""
        if self.render_mode is None:
            return None
        held, (times, travels) = self._held, np.array(self._travels).T
        figure = Figure(figsize=(6.4, 3.2), layout="constrained")
        forces, ways = figure.subplots(1, 2, sharex=True)
        borne = [2.0 * held.friction * self._grip(time) for time in times.tolist()]
        forces.plot(1e3 * times, borne, color=BLUE, label="what friction bears")
        forces.plot(1e3 * times, [held.total_load(time) for time in times.tolist()], color=BLACK, label="load")
        forces.set(ylabel="force along the object [N]", ylim=(0.0, None), xlabel="time since the load began [ms]")
        forces.legend(loc="upper left")
        ways.plot(1e3 * times, 1e3 * travels, color=BLACK)
        ways.axhline(1e3 * held.travel_limit, color=VERMILLION)
        ways.set(ylabel="travel [mm]", xlabel="time since the load began [ms]")
        return pixels(figure)

    def close(self) -> None:
        """Give the memory of the simulation back."""
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None


for _name, _body in (("HoldFinger2D", "finger"), ("HoldTacTip2D", "tactip")):
    gymnasium.register(f"fingerslip/{_name}-v0", entry_point=HoldEnv, kwargs={"body": _body})  # type: ignore[arg-type]
