"""The condensed body that all trials of a study share, kept on disk: made once, with its mesh; and its plate.

The whole sensor in a slide of any direction, from its half in a slide along +x.

A sensor whose rings all have a multiple of k markers looks the same after a turn by 1/k about its axis, and pressed by
a plane square to its axis it moves the same, turned. The half z >= 0 is mirrored at its plane of symmetry. With a plane
that is tilted along the slide, the tilt turns with the slide.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.dynamics.statics.body import StaticBody, static_body
from fingerslip.errors import InputError
from fingerslip.linear.resources import limited_threads
from fingerslip.model.programme import Phase, Press
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.specimens.tactip.profile import MarkerPlaces
from fingerslip.storage.files import digest
from fingerslip.study.definition.runs import Run
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.build import build_mesh, build_model
from fingerslip.study.storage.store import BasisFolder

Floats = NDArray[np.float64]

_VERSION = 1
# How far above the plate skin is watched, over the deepest press.
_REACH = 1.5
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


def body_key(run: Run, settings: TrialSettings, deepest: float) -> str:
    """Return what decides the body of a run under plates that are pressed down to the deepest [m], hashed."""
    values = run.plain_values()
    values_of_body = {name: values.get(name) for name in _OF_BODY}
    specimen = values.get(run.study.specimen_kind or "", {})
    contact = run.study.all_contacts[0].boundary
    return digest(_VERSION, run.mesh_key, values_of_body, specimen, contact, settings.hidden, settings.patch, deepest)


def shared_body(runs: Sequence[Run], settings: TrialSettings, folder: Path) -> tuple[str, StaticBody]:
    """Return the body of all runs with its key, from disk or made anew."""
    key, run, deepest = _one_body(runs, settings)
    store = BasisFolder(folder)
    stored: Mapping[str, Any] | None = store.load(key)
    if stored is not None:
        return key, StaticBody(**stored)
    body = _make(run, settings, _REACH * deepest)
    store.save(key, {field.name: getattr(body, field.name) for field in dataclasses.fields(StaticBody)})
    return key, body


def shared_key(runs: Sequence[Run], settings: TrialSettings) -> str:
    """Return the key of the body of all runs, without making it; see :func:`shared_body` for what is refused."""
    return _one_body(runs, settings)[0]


def _one_body(runs: Sequence[Run], settings: TrialSettings) -> tuple[str, Run, float]:
    """Return the key of the body of all runs, one of these, and the deepest press of all [m]."""
    deepest = max(sum(phase.depth for phase in programme_of(run.study) if isinstance(phase, Press)) for run in runs)
    keys = {body_key(run, settings, deepest): run for run in runs}
    if len(keys) > 1:
        fault = f"have {len(keys)} different sensors or meshes"
        raise InputError("sweep, sample", fault, "needs one in all trials of a data set", "make a study for each")
    ((key, run),) = keys.items()
    return key, run, deepest


def _make(run: Run, settings: TrialSettings, reach: float) -> StaticBody:
    """Condense the body of a run under a plate that is square to the axis, watched as far as `reach` [m].

    What the body answers does not depend on a plate that is free.
    """
    model = build_model(run, build_mesh(run))
    contacts = tuple(
        dataclasses.replace(contact, counterface=Plane((0.0, 1.0, 0.0)), search_distance=reach, rigid_body=None)
        for contact in model.contacts
    )
    upright = dataclasses.replace(model, contacts=contacts, bodies={}, programme=programme_of(run.study))
    with limited_threads(1):
        return static_body(upright, reach=reach, hidden=settings.hidden, patch=settings.patch)


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
