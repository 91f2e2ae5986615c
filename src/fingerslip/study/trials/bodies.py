"""The condensed bodies that trials of a study share, kept on disk, and the whole sensor in a slide of any direction.

At small strain one body serves all trials. At large strain each depth has a body of its own, all of one press, slid
with the largest friction of all trials until the whole contact slips, so that its states reach as far as any trial
shears it.

A sensor whose rings all have a multiple of k markers looks the same after a turn by 1/k about its axis, and pressed by
a plane square to its axis it moves the same, turned. The half z >= 0 is mirrored at its plane of symmetry. With a plane
that is tilted along the slide, the tilt turns with the slide.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Conditions, Coulomb
from fingerslip.dynamics.statics.body import StaticBody, static_body
from fingerslip.dynamics.statics.pressed import pressed_bodies
from fingerslip.errors import InputError, ResultError
from fingerslip.linear.resources import limited_threads
from fingerslip.marker_layouts import MarkerLayout
from fingerslip.model.model import Contact
from fingerslip.model.programme import Phase, Press, Slide, phase_duration
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.model.timing import QuasiStatic
from fingerslip.storage.files import digest
from fingerslip.study.definition.runs import Run
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.build import build_mesh, build_model, name_errors
from fingerslip.study.storage.store import BasisFolder

_VERSION = 7
# How far above the plate skin is watched, over the deepest press; and searched for contact at large strain.
_REACH, _REACH_PRESSED = 1.5, 1.25
# At large strain: steps of press and slide [m], the speed does not matter; what the skin is sheared by from state to
# state, over the depth (docs/tactip.md says what that costs in accuracy); and how far it is slid.
_STEP, _STRIDE, _SPEED, _SPACING, _FARTHEST = 0.07e-3, 0.21e-3, 1e-3, 0.4, 14e-3
# Where the largest friction is looked for: pressures [Pa], slip rates [m/s], slips [m], and how many times.
_PRESSURES, _RATES, _SLIPS, _TIMES = np.geomspace(1e3, 1e6, 7), (0.0, 1e-4, 1e-2), (0.0, 1e-3, 1e-2), 11
# Bodies are not made again for want of room: they may have taken a quarter of an hour.
_MOST_BODIES = 1000
# What a body depends on, of the values of a run.
_OF_BODY = ("materials", "supports", "integration", "kinematics", "formulation", "record")
# Of a turn, by which markers may be beside their places.
_ROUNDING = 1e-6


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


def sensor_key(run: Run, settings: TrialSettings) -> str:
    """Return what decides the sensor of a run, its mesh and its patches, hashed."""
    values = run.plain_values
    values_of_body = {name: values.get(name) for name in _OF_BODY}
    specimen = values.get(run.study.specimen_kind or "", {})
    boundary = run.study.all_contacts[0].boundary
    return digest(_VERSION, run.mesh_key, values_of_body, specimen, boundary, settings.hidden, settings.patch)


@dataclass(frozen=True)
class BodyPlan:
    """A body that some runs share."""

    key: str
    sensor: str  # what it shares with bodies of other depths, hashed
    run: Run  # one of them
    settings: TrialSettings
    depth: float  # of the press, the deepest of all runs at small strain [m]
    friction: float | None = None  # the largest coefficient of all runs; None at small strain

    @property
    def name(self) -> str:
        """What a progress display calls it."""
        return "sensor" if self.friction is None else f"sensor pressed by {1e3 * self.depth:g} mm"


def condensed_bodies(plans: Sequence[BodyPlan], progress: Callable[[str, float], None]) -> Iterator[StaticBody]:
    """Yield bodies under a plate that is square to the axis, from the least depth on: a free one changes no answers."""
    plan = plans[-1]
    hidden, patch, depths = plan.settings.hidden, plan.settings.patch, {each.depth: each.name for each in plans}
    with name_errors(plan.run), limited_threads(1):
        model = build_model(plan.run, build_mesh(plan.run))
        reach = (_REACH if plan.friction is None else _REACH_PRESSED) * plan.depth
        upright = dataclasses.replace(
            model.contacts[0], counterface=Plane((0.0, 1.0, 0.0)), rigid_body=None, search_distance=reach
        )
        if plan.friction is None:
            programme = programme_of(plan.run.study)
            at_rest = dataclasses.replace(model, contacts=(upright,), bodies={}, programme=programme)
            yield static_body(at_rest, reach=reach, hidden=hidden, patch=patch)
            return
        slid = dataclasses.replace(
            model,
            contacts=(dataclasses.replace(upright, friction=Coulomb(plan.friction), programme=None),),
            bodies={},
            programme=(Press(plan.depth, _SPEED), Slide(_FARTHEST, _SPEED)),
            time=QuasiStatic(_STEP / _SPEED),
        )
        try:
            yield from pressed_bodies(
                slid,
                tuple(depths),
                spacing=_SPACING,
                near=hidden,
                patch=patch,
                stride=_STRIDE / _SPEED,
                progress=lambda depth, share: progress(depths[depth], share),
            )
        except InputError as error:
            raise error.moved(lambda where: "trials.hidden" if where == "near" else where) from None


def shared_bodies(runs: Sequence[Run], settings: TrialSettings) -> dict[str, BodyPlan]:
    """Return the body of each run, by its name: one for all, or at large strain one for each depth of press."""
    sensors = {run.name: sensor_key(run, settings) for run in runs}
    if (count := len(set(sensors.values()))) > 1:
        fault = f"have {count} different sensors or meshes"
        raise InputError("sweep, sample", fault, "needs one in all trials of a data set", "make a study for each")
    presses = {run.name: [phase for phase in programme_of(run.study) if isinstance(phase, Press)] for run in runs}
    depths = {name: sum(phase.depth for phase in of_run) for name, of_run in presses.items()}
    if runs[0].study.kinematics == "small":
        deepest, sensor = max(depths.values()), sensors[runs[0].name]
        return dict.fromkeys(sensors, BodyPlan(digest(sensor, deepest), sensor, runs[0], settings, deepest))
    friction, plans = max(map(largest_friction, runs)), {}
    for run in runs:
        contact, depth = run.study.all_contacts[0].contact(3), depths[run.name]
        with name_errors(run):
            _check_large(run, contact)
        penalties = contact.normal_penalty, contact.tangential_penalty
        key = digest(sensors[run.name], depth, friction, *penalties)
        plans[run.name] = BodyPlan(key, sensors[run.name], run, settings, depth, friction)
    return plans


def _check_large(run: Run, contact: Contact) -> None:
    """Refuse what a body that is pressed and slid along +x at large strain does not stand for."""
    study, plate, repair = run.study, plate_of(run.study), "write kinematics: small"
    if not isinstance(study.time.stepping, QuasiStatic):
        raise InputError("time", "has inertia", "needs scheme: quasi_static in trials at large strain", repair)
    if contact.clearance or getattr(contact.counterface, "offset", 0.0):
        raise InputError("contact", "has an offset or a clearance", "needs a plate that touches at first", repair)
    slides = [phase.direction for phase in programme_of(study) if isinstance(phase, Slide)]
    if any(direction is not None and direction[0] <= 0.0 for direction in slides):
        raise InputError(
            "programme.slide.direction", f"is {slides}", "needs +x, in which the sensor is sheared", repair
        )
    if plate is not None and any(load.x < 0.0 for load in plate.loads):
        raise InputError("bodies.loads", "pull along -x", "needs +x, in which the sensor is sheared", repair)


def largest_friction(run: Run) -> float:
    """Return the largest friction coefficient of a run over pressures, slip and the time of its programme [-]."""
    law = run.study.all_contacts[0].contact(3).friction
    end = sum(map(phase_duration, programme_of(run.study)))
    pressure, rate, slip = (each.ravel() for each in np.meshgrid(_PRESSURES, _RATES, _SLIPS))
    return max(
        float(np.max(law.coefficients(Conditions(pressure, rate, slip, time))))
        for time in np.linspace(0.0, end, _TIMES).tolist()
    )


def make_bodies(plans: Sequence[BodyPlan], folder: Path, progress: Callable[[str, float], None]) -> Iterator[BodyPlan]:
    """Make the bodies of a sensor that are not on disk, undamaged; yield each plan whose body is there."""
    store = BasisFolder(folder, most=_MOST_BODIES)
    with store.alone(plans[0].sensor):
        is_there = {plan.key: store.load(plan.key) is not None for plan in plans}
        yield from (plan for plan in plans if is_there[plan.key])
        missing = sorted((plan for plan in plans if not is_there[plan.key]), key=lambda plan: plan.depth)
        for plan, body in zip(missing, condensed_bodies(missing, progress) if missing else (), strict=True):
            store.save(plan.key, {field.name: getattr(body, field.name) for field in dataclasses.fields(StaticBody)})
            yield plan


@functools.lru_cache(maxsize=1)
def stored_body(key: str, folder: Path) -> StaticBody:
    """Return a body from disk; the last one is remembered, as trials of a depth follow each other."""
    arrays: Mapping[str, Any] | None = BasisFolder(folder).load(key)
    if arrays is None:
        raise ResultError(f"{folder / key}.basis: is missing or damaged; start again, then it is made anew")
    return StaticBody(**arrays)


def turned_whole(positions: Floats, half: MarkerLayout, whole: MarkerLayout, turn: float) -> Floats:
    """Return where all markers of a sensor are that slides in a direction.

    Arrays: positions (n_times, n_half, 3) [m]; turn [rad]; returns (n_times, n_whole, 3) [m].
    """
    source = np.mod(whole.angle - turn, 2.0 * np.pi)
    # Angles (2, n_whole, n_half) from places of a slide along +x, and from their mirror images, to markers of the half.
    beside = np.abs(np.angle(np.exp(1j * (half.angle - np.stack((source, -source))[..., None]))))
    beside *= half.ring > 0  # on the axis there is no angle
    beside[:, whole.ring[:, None] != half.ring] = np.inf
    mirrored = beside[0].min(axis=1) >= _ROUNDING
    beside = np.where(mirrored[:, None], beside[1], beside[0])
    rows, lost = beside.argmin(axis=1), beside.min(axis=1) >= _ROUNDING
    if lost.any():
        fault = f"turns ring {whole.ring[lost.argmax()]} by {np.degrees(turn):.4g} degrees to other places"
        raise InputError("trials.directions", fault, "needs a layout that such a turn leaves as it is", "take fewer")
    turned_positions = positions[:, rows].copy()
    turned_positions[:, mirrored, 2] *= -1.0
    cos, sin = np.cos(turn), np.sin(turn)
    x, z = turned_positions[..., 0].copy(), turned_positions[..., 2].copy()
    turned_positions[..., 0], turned_positions[..., 2] = cos * x - sin * z, sin * x + cos * z
    return turned_positions
