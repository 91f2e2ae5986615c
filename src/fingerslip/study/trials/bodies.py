"""The condensed bodies that trials of a study share, kept on disk: made once, with their mesh; and its plate.

At small strain one body serves all trials. At large strain each depth has a body of its own, pressed so far and slid
with the largest friction of all trials, so that its states reach as far as any trial shears it.

The whole sensor in a slide of any direction, from its half in a slide along +x.

A sensor whose rings all have a multiple of k markers looks the same after a turn by 1/k about its axis, and pressed by
a plane square to its axis it moves the same, turned. The half z >= 0 is mirrored at its plane of symmetry. With a plane
that is tilted along the slide, the tilt turns with the slide.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.statics.body import StaticBody, static_body
from fingerslip.dynamics.statics.pressed import pressed_body
from fingerslip.errors import InputError, ResultError
from fingerslip.linear.resources import limited_threads
from fingerslip.model.programme import Phase, Press, Slide
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.model.timing import QuasiStatic
from fingerslip.specimens.tactip.profile import MarkerPlaces
from fingerslip.storage.files import digest
from fingerslip.study.definition.runs import Run
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.build import build_mesh, build_model
from fingerslip.study.storage.store import BasisFolder

Floats = NDArray[np.float64]

_VERSION = 2
# How far above the plate skin is watched, over the deepest press; and searched for contact at large strain.
_REACH, _REACH_PRESSED = 1.5, 1.25
# At large strain: steps of press and slide [m], the speed does not matter; what the skin is sheared by from state to
# state, where forces are within 1 % until gross slip (tests/benchmarks/bench_pressed.py); and how far it is slid.
_STEP, _SPEED, _SPACING, _FARTHEST = 0.25e-3, 1e-3, 0.7e-3, 14e-3
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


def body_key(run: Run, settings: TrialSettings, reach: float, friction: float | None = None) -> str:
    """Return what decides the body of a run, hashed: see :func:`shared_bodies` for `reach` [m] and friction."""
    values = run.plain_values()
    values_of_body = {name: values.get(name) for name in _OF_BODY}
    specimen = values.get(run.study.specimen_kind or "", {})
    contact = run.study.all_contacts[0]
    pressed = [] if friction is None else [friction, contact.normal_penalty, contact.tangential_penalty]
    shape = [settings.hidden, settings.patch, reach]
    return digest(_VERSION, run.mesh_key, values_of_body, specimen, contact.boundary, *shape, *pressed)


@dataclass(frozen=True)
class BodyPlan:
    """A body that some runs share."""

    key: str
    run: Run  # one of them
    settings: TrialSettings
    depth: float  # of the press, the deepest of all runs at small strain [m]
    friction: float | None = None  # the largest coefficient of all runs; None at small strain

    def make(self) -> StaticBody:
        """Condense the body under a plate that is square to the axis: what it answers does not depend on a free one."""
        model = build_model(self.run, build_mesh(self.run))
        reach = (_REACH if self.friction is None else _REACH_PRESSED) * self.depth
        (contact,) = model.contacts
        upright = dataclasses.replace(
            contact, counterface=Plane((0.0, 1.0, 0.0)), search_distance=reach, rigid_body=None
        )
        programme = programme_of(self.run.study)
        with limited_threads(1):
            if self.friction is None:
                at_rest = dataclasses.replace(model, contacts=(upright,), bodies={}, programme=programme)
                return static_body(at_rest, reach=reach, hidden=self.settings.hidden, patch=self.settings.patch)
            slid = dataclasses.replace(
                model,
                contacts=(dataclasses.replace(upright, friction=Coulomb(self.friction)),),
                bodies={},
                programme=(Press(self.depth, _SPEED), Slide(_FARTHEST, _SPEED)),
                time=QuasiStatic(_STEP / _SPEED),
            )
            return pressed_body(slid, spacing=_SPACING, near=self.settings.hidden, patch=self.settings.patch)


def shared_bodies(runs: Sequence[Run], settings: TrialSettings) -> dict[str, BodyPlan]:
    """Return the body of each run, by its name: one for all, or at large strain one for each depth of press."""
    depths = {run.name: press_depth(run) for run in runs}
    frictions = [run.study.all_contacts[0].contact(3).friction.coefficient for run in runs]
    plans = {}
    for run in runs:
        is_finite = run.study.kinematics == "finite"
        depth = depths[run.name] if is_finite else max(depths.values())
        friction = max(frictions) if is_finite else None
        plans[run.name] = BodyPlan(body_key(run, settings, depth, friction), run, settings, depth, friction)
    count = len({plan.key for plan in plans.values()})
    if count > len({plan.depth for plan in plans.values()}):
        fault = f"have {count} different sensors or meshes"
        raise InputError("sweep, sample", fault, "needs one in all trials of a data set", "make a study for each")
    return plans


def press_depth(run: Run) -> float:
    """Return how far the plate of a run is pressed in [m]."""
    return sum(phase.depth for phase in programme_of(run.study) if isinstance(phase, Press))


def make_body(plan: BodyPlan, folder: Path) -> None:
    """Make a body unless it is on disk, undamaged."""
    store = BasisFolder(folder)
    if store.load(plan.key) is None:
        body = plan.make()
        store.save(plan.key, {field.name: getattr(body, field.name) for field in dataclasses.fields(StaticBody)})


@functools.lru_cache(maxsize=1)
def stored_body(key: str, folder: Path) -> StaticBody:
    """Return a body from disk; the last one is remembered, as trials of a depth follow each other."""
    arrays: Mapping[str, Any] | None = BasisFolder(folder).load(key)
    if arrays is None:
        raise ResultError(f"{folder / key}.basis: is missing or damaged; start again, then it is made anew")
    return StaticBody(**arrays)


def turned_whole(positions: Floats, half: MarkerPlaces, whole: MarkerPlaces, turn: float) -> Floats:
    """Return where all markers of a sensor are that slides in a direction.

    Arrays: positions (n_times, n_half, 3) [m]; turn [rad]; returns (n_times, n_whole, 3) [m].
    """
    source = np.mod(whole.azimuth - turn, 2.0 * np.pi)
    rows, mirrored = np.empty(len(source), dtype=np.int64), np.empty(len(source), dtype=bool)
    for number, (ring, azimuth) in enumerate(zip(whole.ring, source, strict=True)):
        rows[number], mirrored[number] = _twin(half, int(ring), float(azimuth), turn)
    turned_positions = positions[:, rows].copy()
    turned_positions[:, mirrored, 2] *= -1.0
    cos, sin = np.cos(turn), np.sin(turn)
    x, z = turned_positions[..., 0].copy(), turned_positions[..., 2].copy()
    turned_positions[..., 0], turned_positions[..., 2] = cos * x - sin * z, sin * x + cos * z
    return turned_positions


def _twin(half: MarkerPlaces, ring: int, azimuth: float, turn: float) -> tuple[int, bool]:
    """Return the marker of the half at a place of the slide along +x, and whether it is its mirror image."""
    for angle, mirrored in ((azimuth, False), (-azimuth, True)):
        # On the axis there is no angle.
        beside = np.abs(np.angle(np.exp(1j * (half.azimuth - angle)))) * (half.along > 0.0)
        beside[half.ring != ring] = np.inf
        row = int(np.argmin(beside))
        if beside[row] < _ROUNDING:
            return row, mirrored
    fault = f"turns ring {ring} by {np.degrees(turn):.4g} degrees to other places"
    raise InputError("trials.directions", fault, "needs a layout that such a turn leaves as it is", "take fewer")
