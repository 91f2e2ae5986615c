"""Sensors in 3D, pressed and slid without inertia by a plate, whole ones beside their halves."""

import dataclasses
import time
from dataclasses import dataclass

import numpy as np
import skfem

import fingerslip as fs
from fingerslip.dynamics.statics.body import static_body
from fingerslip.dynamics.statics.motion import static_motion
from fingerslip.marker_tracks import marker_tracks
from fingerslip.specimens.tactip.meshing import with_names
from fingerslip.specimens.tactip.numbers import REGIONS, modelled_places
from fingerslip.study.trials.bodies import turned_whole

SPEED = 5e-3


def pressed_sensor(sensor, mesh, friction, programme, *, step, reach=None):
    """Return a sensor in 3D that a plate moves in steps [s], with its internal markers."""
    plane = fs.Plane((0.0, 1.0, 0.0))
    contact = fs.Contact("contact", plane, friction, normal_penalty=5e9, tangential_penalty=5e9, search_distance=reach)
    return fs.Model(
        mesh=mesh,
        materials=sensor.materials,
        formulation="solid",
        depth=1.0,
        supports=sensor.supports(3),
        integration="nodal",
        contacts=(contact,),
        time=fs.QuasiStatic(step),
        record=fs.Recording(sites=sensor.sites(("internal_markers",), 3)),
        programme=tuple(programme),
    )


def slid_sensor(sensor, mesh, friction, programme, *, step, reach, hidden, patch):
    """Return the internal markers of a sensor, and their motion in steps [s]; the rest as for `static_body`."""
    model = pressed_sensor(sensor, mesh, friction, programme, step=step, reach=reach)
    body = static_body(model, reach=reach, hidden=hidden, patch=patch)
    return model.record.sites, static_motion(body, model.contacts[0], model.programme, step)


@dataclass(frozen=True)
class Slid:
    """A slide of a whole sensor beside that of its half along x, mirrored and turned."""

    markers: float  # largest distance of a marker from where the half has it, over the largest displacement [-]
    forces: float  # the same of the force, over the largest force [-]
    force: np.ndarray  # (3,), along the slide, up and across it, at the end [N]


def slid_beside_half(sensor, mesh, friction, *, depth, travel, part):
    """Press a whole sensor, slide it along x and at 45 degrees in steps of `part`, and do the same with its half.

    Returns both slides, and the processor seconds of the half and of both slides of the whole together.
    """
    half, whole = (dataclasses.replace(sensor, part=name) for name in ("half", "whole"))

    def model_of(own, its, turn):
        slide = fs.Slide(travel, SPEED, direction=(np.cos(turn), 0.0, np.sin(turn)))
        programme = (fs.Press(depth, SPEED), slide)
        return pressed_sensor(own, its, friction, programme, step=part / SPEED, reach=1.5 * depth)

    start, turns = time.process_time(), (0.0, np.pi / 4)
    of_half = fs.simulate(model_of(half, half_of(mesh), 0.0), threads=1)
    between = time.process_time()
    of_whole = fs.simulate_together([model_of(whole, mesh, turn) for turn in turns], threads=1)
    end = time.process_time()
    straight, aside = (_beside(of_half, own, half, turn) for own, turn in zip(of_whole, turns, strict=True))
    return straight, aside, between - start, end - between


def half_of(whole):
    """Return the half z >= 0 of the mesh of a whole sensor, with the names that a half has."""
    region = np.empty(whole.nelements, dtype=np.int64)
    for number, name in enumerate(REGIONS):
        region[whole.subdomains[name]] = number
    front = np.flatnonzero(whole.p[2, whole.t].mean(axis=0) > 0.0)
    used, corners = np.unique(whole.t[:, front], return_inverse=True)
    mesh = skfem.MeshTet1(np.ascontiguousarray(whole.p[:, used]), corners.reshape(4, -1).astype(np.int32))
    return with_names(mesh, region[front], half=True)


def _beside(of_half, of_whole, half, turn):
    """Compare a slide in the direction `turn` [rad] with that of the half along x."""
    own, straight = (marker_tracks(history, ("internal",))["position"].values for history in (of_whole, of_half))
    wanted = turned_whole(straight, modelled_places(half), half.markers.places, turn)
    size = np.linalg.norm(straight - straight[0], axis=2).max()
    cos, sin = np.cos(turn), np.sin(turn)
    along = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    force = of_whole["counterface_force"].values[:, 0] @ along.T
    # What presses the half across its plane is balanced by the other half.
    doubled = of_half["counterface_force"].values[:, 0] * [2.0, 2.0, 0.0]
    missed, largest = (np.linalg.norm(forces, axis=1).max() for forces in (force - doubled, doubled))
    return Slid(float(np.linalg.norm(own - wanted, axis=2).max() / size), float(missed / largest), force[-1])
