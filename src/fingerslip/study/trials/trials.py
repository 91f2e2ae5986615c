"""Simulated trials: what they are to be, how they are filmed and labelled, and the card of their data set."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN
from fingerslip.detect.labels import LabelSettings, labels_from_contact, labels_from_external_markers, labels_from_plate
from fingerslip.detect.trials import Trial
from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.dynamics.statics.motion import StaticMotion, static_motion
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.model.programme import Hold, Press, Slide, phase_duration
from fingerslip.specimens.tactip.numbers import modelled_places
from fingerslip.specimens.tactip.tactip import TacTip
from fingerslip.study.definition.runs import Run
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.trials.bodies import load_rate, plate_of, programme_of, turned_whole
from fingerslip.version import __version__
from fingerslip.vision.cameras.camera import Pose, interpolate
from fingerslip.vision.cameras.point import MEASURED_ERRORS, CameraPair, pair_tracks, plate_mark
from fingerslip.vision.comparison import PositionErrors
from fingerslip.vision.tracks import make_tracks

#: Groups of sites that a study of trials records, in this order.
RECORDED = ("internal_markers", "external_markers")
# A plate that falls is filmed until it is as far as plates slide in the paper [m].
_FALL = 14e-3


def card_notes(study: Study, settings: TrialSettings) -> str:
    """Return the notes of a data card in Markdown."""
    ranges = study.sample.ranges if study.sample else {}
    template = resources.files("fingerslip").joinpath("data", "templates", "trials.md").read_text(encoding="utf-8")
    notes = template.format(
        motion=f"{'carries half a plate, which falls' if _falls(study) else 'slides'} along its plane of symmetry",
        step=1e3 * study.time.stepping.step,
        settings=settings,
        strains=_LARGE if study.kinematics == "finite" else _SMALL,
        patch=1e3 * settings.patch,
        ranges="".join(f"| `{path}` | {low} to {high} |\n" for path, (low, high) in ranges.items()),
        noise=" to ".join(f"{value:g}" for value in settings.noise),
        shift=1e3 * settings.shift,
        pixel=1e3 * settings.metres_per_pixel,
    )
    return notes.rstrip("\n")


# What the card of a data set says of strains.
_SMALL = """**Strains are small.** That is wrong by 14 % of the normal force at 2 mm of indentation and 27 % at 3 mm
(docs/tactip.md): the kind of slip is shown, not its travel and not its force."""
_LARGE = """**Strains are large.** The sensor was pressed once, and sheared once at each indentation; trials are small
motions about the nearest of some states on that way (docs/tactip.md: how far they are from whole computations).
Where the skin touches, patches are smaller."""


@dataclass(frozen=True)
class TrialPlan:
    """What a trial is to be."""

    number: int  # its number, from 0
    run: Run  # its run
    direction: float  # [rad]
    repeat: int  # how many trials of the same indentation and direction come before it

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"trial-{self.number:04d}"


def trial_plans(runs: tuple[Run, ...], settings: TrialSettings, samples: int | None) -> tuple[TrialPlan, ...]:
    """Return the trials of a study: samples take turns through the directions; without samples each run has all."""
    count = settings.directions
    if samples is None:
        runs, samples = tuple(run for run in runs for _ in range(count)), count
    if samples % count:
        allowed = f"needs a multiple of {count} (trials.directions)"
        raise InputError("sample.count", f"got {samples}", allowed, "directions times repeats")
    angle = 2.0 * math.pi / count
    return tuple(
        TrialPlan(number, run, angle * (number % count), number % samples // count) for number, run in enumerate(runs)
    )


def simulated_trial(plan: TrialPlan, settings: TrialSettings, body: StaticBody, origin: Mapping[str, Any]) -> Trial:
    """Simulate a trial and film it."""
    study, eyes = plan.run.study, drawn_eyes(settings, plan.number)
    contact = study.all_contacts[0].contact(3)
    step, plate = study.time.stepping.step, plate_of(study)
    motion = static_motion(body, contact, programme_of(study), step, plate=plate, farthest=_FALL)
    press, hold, task = _phases(plan)
    begin = phase_duration(press) + hold.duration
    # When the film begins and ends, in the time of the run.
    span = begin - _filmed_rest(hold, settings, eyes), min(begin + phase_duration(task), float(motion.time[-1]))
    markers = _markers(plan, settings, body, motion, span)
    cameras = drawn_cameras(settings, eyes, markers)
    tracks = pair_tracks(cameras, markers)
    # What slips at rest slips by the press: the contact counts from the end of the rest on.
    part = (motion.time >= begin - 1e-9) & (motion.time <= span[1])
    contact_labels = labels_from_contact(motion.time[part] - span[0], motion.stick_ratio[part])
    seen = LabelSettings(rest_frames=max(1, math.floor(settings.rest * settings.frame_rate + 1e-9)))
    if _falls(study):
        mark = plate_mark(cameras, _fallen(plan, motion, span, markers), markers["time"].values)
        labels = {"plate": labels_from_plate(tracks, mark, seen), "contact": contact_labels}
    else:
        labels = {"external_markers": labels_from_external_markers(tracks, seen), "contact": contact_labels}
    sliding = motion.force[int(np.searchsorted(motion.time, span[0] - 1e-9)) :]
    # On the whole sensor, of which the model is half: at rest, and the largest in the slide [N].
    forces = {"normal_force": 2.0 * float(sliding[0, 1]), "friction_force": 2.0 * float(sliding[:, 0].max())}
    return Trial(plan.name, tracks, labels, _conditions(plan, settings, eyes) | forces, _provenance(plan, origin))


def _filmed_rest(hold: Hold, settings: TrialSettings, eyes: Eyes) -> float:
    """Return how long the film shows rest [s]: it begins at any moment of the hold, so that its clock knows nothing."""
    return settings.rest + eyes.wait * (hold.duration - settings.rest)


def check_plan(plan: TrialPlan, settings: TrialSettings) -> None:
    """Refuse runs that are no trials."""
    _sensor(plan)
    _, hold, _ = _phases(plan)
    plate = plate_of(plan.run.study)
    if plate is not None and set(plate.free) - {"x"}:
        fault, name = f"is {', '.join(plate.free)}", plan.run.study.all_contacts[0].rigid_body
        raise InputError(f"bodies.{name}.free", fault, "needs x, as the half of the sensor is mirrored at z = 0")
    if settings.rest > hold.duration:
        fault = f"films {settings.rest:g} s of rest"
        raise InputError("trials.rest", fault, f"needs at most the hold, {hold.duration:g} s")


def _falls(study: Study) -> bool:
    """Tell whether the plate of a trial is free to fall."""
    plate = plate_of(study)
    return plate is not None and bool(plate.free)


def _phases(plan: TrialPlan) -> tuple[Press, Hold, Slide | Hold]:
    """Return the phases of the run of a trial; a plate that is free falls in a second hold."""
    study = plan.run.study
    match programme_of(study):
        case (Press() as press, Hold() as hold, Slide() | Hold() as task) if isinstance(task, Hold) == _falls(study):
            return press, hold, task
        case found:
            kinds = ", ".join(type(phase).__name__ for phase in found) or "nothing"
            needed = "trials need a press, a hold and a slide, or a second hold under a plate that is free"
            raise InputError("programme", f"has {kinds}", needed)


def _markers(
    plan: TrialPlan, settings: TrialSettings, body: StaticBody, motion: StaticMotion, span: tuple[float, float]
) -> xr.Dataset:
    """Return the markers of the whole sensor [m] over the filmed time.

    The outer camera goes with a plate that slides, and stands still beside one that falls: external markers are
    relative to the plate, or to its height alone.
    """
    sensor = _sensor(plan)
    half, whole = modelled_places(sensor), sensor.markers.places
    rest = np.array([site.position for site in sensor.sites(RECORDED, 3)])
    moved, count = rest + motion.displacement, len(half.ring)
    # External markers touch the plate when the film begins where the patch next to them does.
    step = int(np.searchsorted(motion.time, span[0] - 1e-9))
    touching = body.positions[motion.rows][motion.state[step] != OPEN]
    beside = np.linalg.norm(rest[count:, None] - touching, axis=2)
    touches = beside.min(axis=1, initial=np.inf) <= settings.patch
    camera = motion.counterface * (0.0, 1.0, 0.0) if _falls(plan.run.study) else motion.counterface
    outside = np.where(touches[:, None], moved[:, count:] - camera[:, None], np.nan)
    both = [turned_whole(positions, half, whole, plan.direction) for positions in (moved[:, :count], outside)]
    tracks = make_tracks(np.concatenate(both, axis=1), motion.time, units="m")
    times = np.concatenate([span[:1], motion.time[(motion.time > span[0]) & (motion.time < span[1])], span[1:]])
    return make_tracks(
        interpolate(tracks, times),
        times - span[0],
        units="m",
        kind=["internal"] * len(whole.ring) + ["external"] * len(whole.ring),
        ring=np.tile(whole.ring, 2),
        angle=np.tile(whole.angle, 2),
    )


def _fallen(plan: TrialPlan, motion: StaticMotion, span: tuple[float, float], markers: xr.Dataset) -> Floats:
    """Return how far the plate has fallen since the film began, at the times of markers, shape (n, 3) [m]."""
    times = markers["time"].values + span[0]
    x, z = (np.interp(times, motion.time, motion.counterface[:, axis]) for axis in (0, 2))
    x, z = x - x[0], z - z[0]
    cos, sin = math.cos(plan.direction), math.sin(plan.direction)
    return np.column_stack([cos * x - sin * z, np.zeros_like(x), sin * x + cos * z])


def _sensor(plan: TrialPlan) -> TacTip:
    sensor, groups = plan.run.specimen, plan.run.study.record.groups
    if not isinstance(sensor, TacTip) or sensor.part != "half":
        raise InputError("tactip", "is not the half of a sensor", "trials need part: half, slid along its plane")
    if groups != RECORDED:
        raise InputError("record.groups", f"has {', '.join(groups) or 'none'}", f"needs {', '.join(RECORDED)}")
    return sensor


def _conditions(plan: TrialPlan, settings: TrialSettings, eyes: Eyes) -> dict[str, Any]:
    """Return what a trial was done with, in SI units."""
    study = plan.run.study
    press, hold, task = _phases(plan)
    contact = study.all_contacts[0].contact(3)
    law = contact.friction
    x, y, _ = contact.counterface.unit_normal
    if isinstance(task, Slide):
        doing: dict[str, Any] = {"task": "slide", "speed": task.speed, "travel": task.distance}
    else:
        plate = plate_of(study)
        assert plate is not None  # a second hold is refused without one
        # The model is half of the sensor.
        doing = {"task": "pour", "load_rate": 2.0 * load_rate(plate)}
    return {
        "indentation": press.depth,
        "direction": plan.direction,
        **doing,
        "friction_coefficient": law.coefficient,
        **{f"friction_{name}": value for name, value in vars(law).items() if name != "static"},
        "tilt": math.atan2(float(x), float(y)),
        "repeat": plan.repeat,
        "rest": _filmed_rest(hold, settings, eyes),
        "seed": eyes.seed,
        "noise": eyes.noise,
        "camera_shift_x": eyes.shift[0],
        "camera_shift_z": eyes.shift[1],
        "camera_turn": eyes.turn,
        "metres_per_pixel": settings.metres_per_pixel,
    }


def _provenance(plan: TrialPlan, origin: Mapping[str, Any]) -> dict[str, Any]:
    return {
        **origin,
        "program": f"fingerslip {__version__}",
        "run": plan.run.name,
        "swept": {path: str(value) for path, value in plan.run.swept.items()},
        "sampled": {path: str(value) for path, value in plan.run.sampled.items()},
        "strains": "large" if plan.run.study.kinematics == "finite" else "small",
        "steps": f"quasi-static, {plan.run.study.time.stepping.step:g} s, joined by straight lines",
    }


@dataclass(frozen=True)
class Eyes:
    """The cameras of one trial."""

    noise: float  # standard deviation of positions [px]
    shift: tuple[float, float]  # (float, float), how far the cameras are beside the axis, along x and z [m]
    turn: float  # how far they are turned about their own axis [rad]
    seed: int  # seed of the errors
    wait: float  # how much earlier than it must the film begins, as a share of what the hold allows [-]


def drawn_eyes(settings: TrialSettings, number: int) -> Eyes:
    """Return the cameras of a trial, drawn from its number and the seed of the data set."""
    draw = np.random.default_rng([settings.seed, number])
    x, z, turn = draw.uniform(-1.0, 1.0, 3)
    noise, seed = draw.uniform(*settings.noise), int(draw.integers(2**31))
    shift, turned = (settings.shift * float(x), settings.shift * float(z)), settings.turn * float(turn)
    return Eyes(float(noise), shift, turned, seed, float(draw.random()))


def drawn_cameras(settings: TrialSettings, eyes: Eyes, markers: xr.Dataset) -> CameraPair:
    """Return the cameras of a trial, which look at its markers [m]."""
    cameras = {}
    for kind in ("internal", "external"):
        markers_of_kind = markers.isel(marker=np.flatnonzero(markers["kind"].values == kind))
        heights = markers_of_kind["position"].values[0, :, 1]
        camera = settings.camera(kind, heights, frame_rate=settings.frame_rate, exposure=0.0)
        pose, (x, z) = camera.pose, eyes.shift
        position, target = ((at[0] + x, at[1], at[2] + z) for at in (pose.position, pose.target))
        up = np.cos(eyes.turn) * np.asarray(pose.up) + np.sin(eyes.turn) * pose.rotation[0]
        pose = Pose(position, target, (float(up[0]), float(up[1]), float(up[2])))
        cameras[kind] = dataclasses.replace(camera, pose=pose)
    share = eyes.noise / MEASURED_ERRORS.noise
    errors = PositionErrors(eyes.noise, share * MEASURED_ERRORS.bias, MEASURED_ERRORS.correlation)
    return CameraPair(cameras["internal"], cameras["external"], errors, eyes.seed)
