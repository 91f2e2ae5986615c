"""Record states into the arrays of a history, one for each of :data:`fingerslip.history.VARIABLES`.

A step only copies what the history needs, `_RECORDED`, in :meth:`Recorder.record`. What follows from that is computed
for many steps at once, in `_complete`.
"""

from __future__ import annotations

import logging
import operator
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.recording.dataset import record_coordinates
from fingerslip.dynamics.recording.schedule import record_shapes, record_type, snapshot_steps
from fingerslip.dynamics.recording.snapshots import Recoveries, SnapshotRecords, of_state
from fingerslip.dynamics.recording.support_records import SupportRecords
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.viscoelastic import viscous_steps
from fingerslip.dynamics.system.bodies import body_centres, faces_of
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.fe.finite.recovery import finite_site_recovery
from fingerslip.fe.space import deformation_gradients, vector_dofs
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.model.model import Model
from fingerslip.units import coordinates

_logger = logging.getLogger("fingerslip.dynamics")

_ENERGIES = {
    "kinetic_energy": "kinetic",
    "strain_energy": "strain",
    "contact_energy": "contact",
    "friction_dissipation": "friction",
    "damping_dissipation": "damping",
    "viscous_dissipation": "viscous",
    "numerical_dissipation": "numerical",
    "external_work": "external_work",
    "energy_imbalance": "imbalance",
}
# What follows from strains at sites, and how; what is as it was recorded, or needs no more than the last motion.
_OF_STRAINS = {"stress": "stresses", "strain": "tensors", "strain_energy_density": "energy_densities"}
_AS_RECORDED = ("gap", "slip_distance", "contact_state")
# What is taken at sites, at candidates and next to supports.
_FIELDS = ("displacement", "velocity", "acceleration")
_RECORDED = (
    *(*_FIELDS, *(f"contact_{name}" for name in _FIELDS), *_AS_RECORDED),
    *("normal_traction", "tangential_traction", "counterface_displacement", "contact_iterations", "contact_residual"),
)
# Of these, what bodies add to, and the forces that tractions are made of.
_CHANGED = ("counterface_displacement", "normal_traction", "tangential_traction")
# Variables of translations and of rotations: displacement, velocity and acceleration.
_SHIFTS = ("rigid_body_displacement", "rigid_body_velocity", "rigid_body_acceleration")
_TURNS = ("rigid_body_rotation", "rigid_body_angular_velocity", "rigid_body_angular_acceleration")
_fields_of = operator.attrgetter(*_FIELDS)
_energies_of = operator.attrgetter(*_ENERGIES.values())
# Steps whose strains are computed at once, and contact candidates times steps that are completed at once.
_STEPS_AT_ONCE, _AT_ONCE = 64, 50_000


class Recorder:
    """Arrays of a history, filled step by step."""

    def __init__(self, model: Model, system: System, times: Floats, recoveries: Recoveries) -> None:
        self._system, self._size, self._next = system, times.size, 0
        space, dim = system.space, system.space.dim
        regions = [site.region for site in model.record.sites]
        body = system.body
        self._finite = None if body is None else finite_site_recovery(body.bulk, system.site_nodes, regions)
        self._at_sites = recoveries.at_sites(system.site_nodes, regions)
        scheme = make_scheme(model.time)
        self._viscous = viscous_steps(system.viscoelastic, scheme.step)
        # Of large strain and of viscoelastic materials, stresses follow from more than the strains at sites.
        self._of_states = body is not None or bool(self._viscous)
        self._supports = SupportRecords(system, scheme, model.damping, self._viscous)
        # The counterfaces on each rigid body, and the centre of the body of each counterface [m].
        self._faces = {name: faces_of(model, name) for name in model.bodies}
        self._centres = body_centres(model)[1]
        near = self._at_sites.near
        touching = system.coordinates.components(vector_dofs(system.candidates.nodes, dim).ravel())
        self._taken = np.unique(np.concatenate([near.rows, touching.rows, self._supports.near]))
        self._near, self._touching = near.among(self._taken), touching.among(self._taken)
        self._beside = np.searchsorted(self._taken, self._supports.near)
        self._rigid = system.coordinates.rigid
        self._at_once = min(_STEPS_AT_ONCE, self._size)
        self._observed = np.zeros((len(_FIELDS), self._at_once, self._taken.size))
        self._completed = (-1, -1)
        snapshots = snapshot_steps(times, model.record.snapshots_every)
        self._snapshots = SnapshotRecords(system, recoveries, self._viscous, snapshots)
        # What a history says of a section, whose forces are those of its depth [m].
        self.attributes: dict[str, Any] = {"depth": model.depth} if space.dim == 2 else {}
        self.coordinates = record_coordinates(model, system, times, times[snapshots])
        candidates = len(system.candidates.nodes)
        shapes = record_shapes(model, self._size, len(snapshots), len(space.positions), candidates)
        has = {name: snapshots or "snapshot_time" not in VARIABLES[name].dims for name in shapes}
        self._shapes = {name: shape for name, shape in shapes.items() if has[name]}
        of_states = set(_OF_STRAINS) if self._of_states else set()
        recorded = self._shapes.keys() & {*_RECORDED, *of_states, *self._snapshots.recorded}
        self._arrays: dict[str, Any] = {
            name: np.zeros(self._shapes[name], dtype=record_type(name)) for name in sorted(recorded)
        }
        # Friction along the tangents, where frames turn; where they do not, it is what the normal force leaves.
        turning = candidates if system.constant_frames() is None else 0
        kept = {
            "strains": self._at_sites.strain_shape,
            "energies": (len(_ENERGIES),),
            "limits": (candidates,),
            "friction": (turning, dim - 1),
            "moved": (len(_FIELDS), self._rigid.size),
            "held": (3, self._supports.count),
        }
        self._arrays |= {name: np.zeros((self._size, *shape)) for name, shape in kept.items()}

    @property
    def room(self) -> int:
        """Steps that may be recorded together next."""
        return self._at_once - self._next % self._at_once

    def record(self, state: State) -> None:
        """Record the next state, or as many as there is :attr:`room` for, time first in their arrays."""
        first, count, arrays = self._next, np.size(state.time), self._arrays
        step: int | slice = slice(first, first + count) if np.ndim(state.time) else first
        self._next += count
        row = first % self._at_once
        for number, field in enumerate(_fields_of(state)):
            observed = self._observed[number]
            rows = observed[row : row + len(field)] if field.ndim == 2 else observed[row]
            np.take(field, self._taken, axis=-1, out=rows, mode="clip")
            if self._rigid.size:
                arrays["moved"][step, number] = field[..., self._rigid]
        # The arrays of tractions hold forces until they are completed.
        interface = state.interface
        arrays["gap"][step] = interface.relative[..., 0]
        arrays["normal_traction"][step] = interface.forces[..., 0]
        arrays["tangential_traction"][step] = state.contact_forces
        arrays["slip_distance"][step] = interface.slip_distance
        arrays["contact_state"][step] = interface.state
        arrays["counterface_displacement"][step] = state.counterfaces
        arrays["limits"][step] = interface.limit
        if arrays["friction"].size:
            arrays["friction"][step] = interface.forces[..., 1:]
        self._supports.record(arrays["held"][step], state)
        if self._next % self._at_once == 0:
            self._complete_last()
        if self._of_states:
            recovery = self._finite or self._at_sites.recovery
            sites, strained = of_state(self._viscous, state, recovery, self._at_sites.strains)
            for name, method in _OF_STRAINS.items():
                arrays[name][step] = getattr(sites, method)(strained)
        for column, energy in enumerate(_energies_of(state.energies)):
            arrays["energies"][step, column] = energy
        arrays["contact_iterations"][step] = state.iterations
        arrays["contact_residual"][step] = state.residual
        self._snapshots.record(first, state, arrays)
        is_last = self._next == self._size
        is_seen = is_last or any(number in self._snapshots for number in range(first, self._next))
        if state.body is None and is_seen:
            last = state.displacement if count == 1 else state.displacement[-1]
            self._judge_small_strain(self._system.coordinates.on_mesh(np.ravel(last)))

    def _judge_small_strain(self, displacement: Floats) -> None:
        """Keep the largest strain at displacements (n_dofs,) [m], and warn of cells that they turn inside out."""
        space = self._system.space
        gradients = deformation_gradients(space, displacement)
        centres = space.mesh.p[:, space.mesh.t].mean(axis=1).T
        strains = 0.5 * (gradients + gradients.swapaxes(1, 2)) - np.eye(space.dim)
        principal = np.abs(np.linalg.eigvalsh(strains)).max(axis=1)
        if (largest := float(principal.max())) > self.attributes.get("largest_strain", 0.0):
            self.attributes |= {"largest_strain": largest, "largest_strain_position": centres[principal.argmax()]}
        inverted = np.flatnonzero(np.linalg.det(gradients) <= 0.0)
        if inverted.size and "inverted_cells" not in self.attributes:
            self.attributes["inverted_cells"] = int(inverted.size)
            place = coordinates(centres[inverted[0]])
            _logger.warning(
                "kinematics: small strain turns %d of %d cells inside out, such as that at %s: write kinematics: "
                "finite, or load the body less",
                *(inverted.size, space.mesh.nelements, place),
            )

    def pass_by(self, state: State) -> None:
        """Take note of a state between two that are recorded: the inertia of what is held goes on from it."""
        self._supports.pass_by(self._next, state)

    def at(self, step: int, name: str) -> Any:
        """Return a variable at a step that was recorded; where more than the motion is needed for it, None."""
        if name in _AS_RECORDED or (self._of_states and name in _OF_STRAINS):
            return self._arrays[name][step].copy()
        if name not in _FIELDS and name not in _OF_STRAINS:
            return None
        if self._completed != (step, self._next):
            self._completed = step, self._next
            self._complete_last(self._next - step)
        if name in _FIELDS:
            return self._arrays[name][step].copy()
        return getattr(self._at_sites.recovery, _OF_STRAINS[name])(self._arrays["strains"][step : step + 1])[0]

    def values(self, start: int = 0, end: int | None = None) -> dict[str, Any]:
        """Return the history from one step to before another, or to the last that was recorded.

        What is as it was recorded is not copied. Forces of supports are right where the first step is among them.
        """
        end = self._next if end is None else end
        # Of all steps that are kept together, rounding is that of a motion that nobody observes.
        self._complete_last(end - start if end == self._next else _STEPS_AT_ONCE)
        self._snapshots.carry(self._arrays)
        cuts = {"time": slice(start, end), "snapshot_time": self._snapshots.between(start, end)}
        values = {
            name: value[cuts[dim]] if (dim := _first_dimension(name)) in cuts else value
            for name, value in (self.coordinates | self._arrays).items()
        }
        for name, shape in self._shapes.items():
            if name not in values:
                count = len(values[_first_dimension(name)])
                values[name] = np.zeros((count, *shape[1:]), dtype=record_type(name))
        self._complete(values)
        return {name: values[name] for name in (*COORDINATES, *VARIABLES) if name in values}

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""
        self._snapshots.carry(self._arrays)
        nowhere = np.zeros(self._system.space.dim)
        nothing = {"inverted_cells": 0, "largest_strain": 0.0, "largest_strain_position": nowhere}
        judged = {name: self.attributes.get(name, none) for name, none in nothing.items()}
        return {"next": self._next, "judged": judged, "observed": self._observed, **self._arrays}

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""
        self._next = saved["next"]
        self.attributes |= {name: value for name, value in saved["judged"].items() if np.any(value)}
        for name, array in {"observed": self._observed, **self._arrays}.items():
            array[...] = saved[name]

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces move otherwise from now on."""
        self._system = system

    def _complete(self, values: dict[str, Any]) -> None:
        """Fill in what follows from recorded states."""
        system = self._system
        values |= {name: values[name].copy() for name in _CHANGED}
        self._snapshots.complete(values)
        if not self._of_states:
            for name, method in _OF_STRAINS.items():
                values[name] = getattr(self._at_sites.recovery, method)(values["strains"])
        for name, energies in zip(_ENERGIES, values["energies"].T, strict=True):
            values[name] = energies.copy()
        self._complete_motion(values)
        self._supports.complete(values)
        at_once = max(1, _AT_ONCE // max(1, len(system.candidates.nodes)))
        for start in range(0, len(values["time"]), at_once):
            self._complete_tractions(values, slice(start, start + at_once))
        # What contacts exert on rigid bodies is the opposite of what acts on the deformable ones.
        for number, faces in enumerate(self._faces.values()):
            for name in ("force", "moment"):
                of_faces = values[f"counterface_{name}"][:, list(faces)]
                values[f"rigid_body_{name}"][:, number] = -of_faces.sum(axis=1)

    def _complete_motion(self, values: dict[str, Any]) -> None:
        """Add what bodies do to the prescribed motion of the counterfaces, and fill in their own motion."""
        times, moved, system = values["time"], values["moved"], self._system
        if system.motions:
            values["counterface_velocity"] += np.stack([motion.velocity(times) for motion in system.motions], axis=1)
        for column, freedom in enumerate(system.unknowns.freedoms):
            for row, name in enumerate(("displacement", "velocity")):
                for face in freedom.faces:
                    values[f"counterface_{name}"][:, face] += moved[:, row, column, None] * freedom.shift
            if freedom.body is not None:
                number = list(self._faces).index(freedom.body)
                # The only axis of rotation in 2D is z.
                axis = freedom.axis if system.space.dim == 3 or not freedom.turns else 0
                for row, name in enumerate(_TURNS if freedom.turns else _SHIFTS):
                    values[name][:, number, axis] = moved[:, row, column]
        for number, faces in enumerate(self._faces.values()):
            for name in ("displacement", "velocity") if faces else ():
                values[f"rigid_body_{name}"][:, number] = values[f"counterface_{name}"][:, faces[0]]

    def _complete_last(self, count: int = _STEPS_AT_ONCE) -> None:
        """Compute what follows from the last steps that are kept, or from some of them."""
        first = (self._next - 1) // self._at_once * self._at_once
        start = max(first, self._next - count)
        steps, arrays = slice(start, self._next), self._arrays
        strains, observed = arrays["strains"][steps], self._observed[:, start - first : self._next - first]
        near, touching = self._near.read(observed), self._touching.read(observed)
        strains[:] = (self._at_sites.strain @ near[0].T).T.reshape(strains.shape)
        self._supports.follow(arrays["held"][steps], observed[..., self._beside])
        for name, around, values_of_contact in zip(_FIELDS, near, touching, strict=True):
            sites, contact = arrays[name][steps], arrays[f"contact_{name}"][steps]
            sites[:] = (self._at_sites.motion @ around.T).T.reshape(sites.shape)
            contact[:] = values_of_contact.reshape(contact.shape)

    def _complete_tractions(self, values: dict[str, Any], steps: slice) -> None:
        """Sum up the forces in the arrays of tractions, and make tractions of them."""
        candidates, friction = self._system.candidates, values["friction"]
        normal, forces = values["normal_traction"][steps], values["tangential_traction"][steps]
        moved = values["contact_displacement"][steps]
        moved = moved - values["counterface_displacement"][steps][:, candidates.counterface]
        about_centres = moments(candidates.positions - self._centres[candidates.counterface] + moved, forces)
        points, rotations, turned = candidates.positions + moved, self._system.rotations, None
        if rotations is not None:
            turning = [freedom.turns and bool(freedom.faces) for freedom in self._system.unknowns.freedoms]
            turned = rotations.matrices(values["moved"][steps, 0][:, turning])[:, candidates.counterface]
            points = rotations.seen(turned, points, candidates.counterface)
        owners = [candidates.counterface == number for number in range(len(self._system.counterfaces.shapes))]
        for number, owner in enumerate(owners):
            values["counterface_force"][steps, number] = forces[:, owner].sum(axis=1)
            values["counterface_moment"][steps, number] = about_centres[:, owner].sum(axis=1)
        counterface = np.tile(candidates.counterface, len(normal))
        points = points.reshape(-1, self._system.space.dim)
        if friction.size:
            frames = self._system.counterfaces.frames(points, counterface).reshape(*forces.shape, points.shape[1])
            forces[:] = np.einsum("...ij,...i->...j", frames[..., 1:, :], friction[steps])
            if turned is not None:
                forces[:] = np.einsum("...ij,...j->...i", turned, forces)
        else:
            forces -= normal[..., None] * self._system.counterfaces.normals(points, counterface).reshape(forces.shape)
        for number, owner in enumerate(owners):
            limits = values["limits"][steps][:, owner]
            used = values["friction_utilisation"][steps, number], values["largest_friction_utilisation"][steps, number]
            _write_utilisation(forces[:, owner], limits, *used)
        forces /= candidates.area[:, None]
        normal /= candidates.area


def _write_utilisation(friction: Floats, limits: Floats, whole: Floats, largest: Floats) -> None:
    """Compare friction forces (n_steps, k, dim) [N] on a counterface with their limits (n_steps, k) [N], (n_steps,)."""
    nodal, total = np.linalg.norm(friction, axis=-1), limits.sum(axis=1)
    np.divide(np.linalg.norm(friction.sum(axis=1), axis=-1), total, out=whole, where=total > 0.0)
    shares = np.divide(nodal, limits, out=np.zeros_like(nodal), where=limits > 0.0)
    largest[:] = shares.max(axis=1, initial=0.0)


def _first_dimension(name: str) -> str:
    """Return the first dimension of a variable; what is kept beside them is kept over time."""
    variable = VARIABLES.get(name) or COORDINATES.get(name)
    return variable.dims[0] if variable else "time"


def moments(arms: Floats, forces: Floats) -> Floats:
    """Return the moments of forces at the end of arms, (..., 3) in 3D and (..., 1) in 2D [N m].

    Examples
    --------
    >>> moments(np.array([[2.0, 1.0]]), np.array([[0.0, 3.0]])).tolist()
    [[6.0]]
    """
    if arms.shape[-1] == 3:
        return np.cross(arms, forces)
    about_z: Floats = arms[..., :1] * forces[..., 1:] - arms[..., 1:] * forces[..., :1]
    return about_z
