"""Record states into the arrays of a history.

A step only copies what the history needs. What follows from it is computed for many steps at once.
"""

from __future__ import annotations

import copy
import functools
import logging
import operator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.recording.body_records import BodyRecords, SupportRecords, moments
from fingerslip.dynamics.recording.labels import record_coordinates
from fingerslip.dynamics.recording.snapshots import Recoveries, SnapshotRecords, dashpots_reader
from fingerslip.dynamics.recording.steps import record_shapes, record_type, snapshot_steps
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.viscoelastic import viscous_steps
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.fe.finite.recovery import finite_site_recovery
from fingerslip.fe.space import inverted_cells, vector_dofs
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation
from fingerslip.materials.viscoelastic import Relaxed, follow_strains
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive
from fingerslip.units import coordinates

__all__ = ["Recorder"]

Array = NDArray[np.float64]

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
_AS_RECORDED = frozenset({"gap", "slip_distance", "contact_state"})
# What is taken at sites, at candidates and next to supports.
_FIELDS = ("displacement", "velocity", "acceleration")
_fields_of = operator.attrgetter(*_FIELDS)
_energies_of = operator.attrgetter(*_ENERGIES.values())
# Steps whose strains are computed at once, and contact candidates times steps that are completed at once.
_STEPS_AT_ONCE, _AT_ONCE = 64, 50_000


# What a recorder keeps beside its values.
_KEPT = ("_strains", "_observed", "_limits", "_friction", "_energies")


class Recorder:
    """Arrays of a history, filled step by step.

    Arrays: times (n_times,) [s].
    """

    def __init__(self, model: Model, system: System, times: Array, recoveries: Recoveries | None = None) -> None:
        self._system, self._times, self._next, self._is_part = system, times, 0, False
        coordinates, space = system.coordinates, system.space
        regions = [site.region for site in model.record.sites]
        body = system.body
        self._finite = None if body is None else finite_site_recovery(body.bulk, system.site_nodes, regions)
        self._recoveries = recoveries or Recoveries(system)
        self._at_sites = self._recoveries.at_sites(system.site_nodes, regions)
        at_once = min(_STEPS_AT_ONCE, times.size)
        self._energies = np.zeros((times.size, len(_ENERGIES)))
        self._strains = np.zeros((times.size, *self._at_sites.strain_shape))
        self._scheme = make_scheme(model.time)
        # A function that is not its own: a recorder in a ring would keep all factors until Python looks for rings.
        histories = functools.partial(_strain_histories, system.materials.formulation, self._scheme.step)
        self._sites = replace(self._at_sites.recovery, relax=histories)
        self._viscous = viscous_steps(system.viscoelastic, self._scheme.step)
        # Dashpots follow recorded strains from step to step; where steps lie between records, states remember them.
        self._of_states = bool(self._viscous) and isinstance(model.time, Adaptive)
        self._supports = SupportRecords(system, self._scheme, model.damping, times.size)
        near = self._at_sites.near
        touching = coordinates.components(vector_dofs(system.candidates.nodes, space.dim).ravel())
        self._taken = np.unique(np.concatenate([near.rows, touching.rows, self._supports.near]))
        self._near, self._touching = near.among(self._taken), touching.among(self._taken)
        self._beside = np.searchsorted(self._taken, self._supports.near)
        self._observed = np.zeros((len(_FIELDS), at_once, self._taken.size))
        self._bodies = BodyRecords(model, system, times)
        self._limits = np.zeros((times.size, len(system.candidates.nodes)))
        # Friction along the tangents, where frames turn; where they do not, it is what the normal force leaves.
        turning = times.size if system.constant_frames() is None else 0
        self._friction = np.zeros((turning, len(system.candidates.nodes), space.dim - 1))
        snapshots = snapshot_steps(times, model.record.snapshots_every)
        self._has_warned, self._completed = False, (-1, -1)
        self._snapshots = SnapshotRecords(system, self._recoveries, self._viscous, snapshots)
        counts = times.size, len(snapshots), len(space.positions), len(system.candidates.nodes)
        self.values: dict[str, Any] = {
            name: np.zeros(shape, dtype=record_type(name))
            for name, shape in record_shapes(model, *counts).items()
            if snapshots or "snapshot_time" not in VARIABLES[name].dims
        }
        self.values |= record_coordinates(model, system, times, times[snapshots])

    @property
    def _at_once(self) -> int:
        """Steps that are completed at once."""
        return self._observed.shape[1]

    @property
    def room(self) -> int:
        """Steps that may be recorded together next."""
        return self._at_once - self._next % self._at_once

    @property
    def nbytes(self) -> int:
        """Memory that the arrays take when they are filled [bytes]."""
        arrays: list[Array] = [*(getattr(self, name) for name in _KEPT), *self._supports.kept.values()]
        return sum(array.nbytes for array in arrays) + sum(np.asarray(value).nbytes for value in self.values.values())

    def record(self, state: State) -> None:
        """Record the next state, or as many as there is :attr:`room` for, time first in their arrays."""
        first, count = self._next, np.size(state.time)
        step: int | slice = slice(first, first + count) if np.ndim(state.time) else first
        self._next += count
        row = first % self._at_once
        for field, observed in zip(_fields_of(state), self._observed, strict=True):
            rows = observed[row : row + len(field)] if field.ndim == 2 else observed[row]
            np.take(field, self._taken, axis=-1, out=rows, mode="clip")
        self._bodies.record(step, state)
        self._record_contact(step, state)
        self._supports.record(step, state)
        if self._next % self._at_once == 0:
            self._complete_last()
        if self._finite is not None and state.body is not None:
            self.values["stress"][step] = self._finite.stresses(state.body.deformed)
            self.values["strain"][step] = self._finite.tensors(state.body.deformed)
            self.values["strain_energy_density"][step] = self._finite.energy_densities(state.body.deformed)
        if self._of_states:
            # Stresses of viscoelastic materials follow from what the state remembers.
            strains = self._sites.strains(self._system.coordinates.on_mesh(state.displacement))
            sites = replace(self._sites, relax=dashpots_reader(self._system, self._viscous, state, self._sites))
            for name, method in _OF_STRAINS.items():
                self.values[name][step] = getattr(sites, method)(strains)
        for column, energy in enumerate(_energies_of(state.energies)):
            self._energies[step, column] = energy
        self.values["contact_iterations"][step] = state.iterations
        self.values["contact_residual"][step] = state.residual
        self._snapshots.record(first, state, self.values)
        is_last = self._next == self._times.size
        is_seen = is_last or any(number in self._snapshots for number in range(first, self._next))
        if state.body is None and not self._has_warned and is_seen:
            last = state.displacement if count == 1 else state.displacement[-1]
            self._warn_of_inverted_cells(self._system.coordinates.on_mesh(np.ravel(last)))

    def _warn_of_inverted_cells(self, displacement: Array) -> None:
        """Warn where small strain does not hold: cells are turned inside out (n_dofs,) [m]."""
        space = self._system.space
        inverted = np.flatnonzero(inverted_cells(space, displacement))
        if inverted.size:
            self._has_warned = True
            place = coordinates(space.mesh.p[:, space.mesh.t[:, inverted[0]]].mean(axis=1))
            _logger.warning(
                "kinematics: small strain turns %d of %d cells inside out, such as that at %s: write kinematics: "
                "finite, or load the body less",
                *(inverted.size, space.mesh.nelements, place),
            )

    def pass_by(self, state: State) -> None:
        """Take note of a state between two that are recorded: the inertia of what is held goes on from it."""
        self._supports.pass_by(self._next, state)

    def at(self, step: int, name: str) -> Any:
        """Return a variable at a step that was recorded; where all of the others are needed for it, None."""
        if name in _AS_RECORDED:
            return self.values[name][step].copy()
        is_elastic = self._finite is None and not self._viscous
        if name not in _FIELDS and not (is_elastic and name in _OF_STRAINS):
            return None
        if self._completed != (step, self._next):
            self._completed = step, self._next
            self._complete_last(self._next - step)
        if name in _FIELDS:
            return self.values[name][step].copy()
        return getattr(self._sites, _OF_STRAINS[name])(self._strains[step : step + 1])[0]

    def part(self, start: int, end: int) -> Recorder:
        """Return a completed copy of the records from one step to before another that were made so far."""
        # Of all steps that are kept together, rounding is that of a motion that nobody observes.
        self._complete_last(end - start if end == self._next else _STEPS_AT_ONCE)
        self._snapshots.carry(self.values)
        steps = slice(start, end)
        snapshots, shots = self._snapshots.part(start, end)
        recorder, cuts = copy.copy(self), {"time": steps, "snapshot_time": shots}
        vars(recorder).update(
            values={
                name: value[cuts[dim]].copy() if (dim := _first_dimension(name)) in cuts else value
                for name, value in self.values.items()
            },
            _times=self._times[steps],
            _strains=self._strains[steps],
            _supports=self._supports.part(steps),
            _limits=self._limits[steps],
            _friction=self._friction[steps],
            _energies=self._energies[steps],
            _bodies=self._bodies.part(steps),
            _snapshots=snapshots,
            _is_part=True,
        )
        recorder.complete()
        return recorder

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""
        self._snapshots.carry(self.values)
        arrays = {name: getattr(self, name) for name in _KEPT} | self._supports.kept
        over_time = {name for name in VARIABLES if _first_dimension(name) in {"time", "snapshot_time"}}
        values = {name: value for name, value in self.values.items() if name in over_time}
        return {"next": self._next, "values": values, "moved": self._bodies.moved, **arrays}

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""
        self._next = saved["next"]
        for name in _KEPT:
            getattr(self, name)[...] = saved[name]
        for name, array in self._supports.kept.items():
            array[...] = saved[name]
        for name, value in saved["values"].items():
            self.values[name][...] = value
        self._bodies.moved[...] = saved["moved"]

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces move otherwise from now on."""
        self._system = system
        self._bodies.steer(system)

    def complete(self) -> None:
        """Fill in what follows from the recorded states."""
        if not self._is_part:
            self._complete_last()
            self._snapshots.carry(self.values)
        self._snapshots.complete(self.values)
        if self._finite is None and not self._of_states:
            for name, method in _OF_STRAINS.items():
                self.values[name][:] = getattr(self._sites, method)(self._strains)
        self.values |= {name: energy.copy() for name, energy in zip(_ENERGIES, self._energies.T, strict=True)}
        self._bodies.complete_motion(self.values)
        self._supports.complete(self.values)
        candidates = self._system.candidates
        at_once = max(1, _AT_ONCE // max(1, len(candidates.nodes)))
        for start in range(0, len(self._times), at_once):
            self._complete_tractions(slice(start, start + at_once))
        self._bodies.complete_forces(self.values)

    def _record_contact(self, step: int | slice, state: State) -> None:
        """Record what the contact did; the arrays of tractions hold forces until they are completed."""
        values, interface = self.values, state.interface
        values["gap"][step] = interface.relative[..., 0]
        values["normal_traction"][step] = interface.forces[..., 0]
        values["tangential_traction"][step] = state.contact_forces
        values["slip_distance"][step] = interface.slip_distance
        values["contact_state"][step] = interface.state
        values["counterface_displacement"][step] = state.counterfaces
        self._limits[step] = interface.limit
        if self._friction.size:
            self._friction[step] = interface.forces[..., 1:]

    def _complete_last(self, count: int = _STEPS_AT_ONCE) -> None:
        """Compute what follows from the last steps that are kept, or from some of them."""
        first = (self._next - 1) // self._at_once * self._at_once
        start = max(first, self._next - count)
        steps = slice(start, self._next)
        strains, observed = self._strains[steps], self._observed[:, start - first : self._next - first]
        near, touching = self._near.read(observed), self._touching.read(observed)
        strains[:] = (self._at_sites.strain @ near[0].T).T.reshape(strains.shape)
        self._supports.follow(steps, observed[..., self._beside])
        for name, around, values_of_contact in zip(_FIELDS, near, touching, strict=True):
            sites, contact = self.values[name][steps], self.values[f"contact_{name}"][steps]
            sites[:] = (self._at_sites.motion @ around.T).T.reshape(sites.shape)
            contact[:] = values_of_contact.reshape(contact.shape)

    def _complete_tractions(self, steps: slice) -> None:
        """Sum up the forces in the arrays of tractions, and make tractions of them."""
        values, candidates = self.values, self._system.candidates
        normal, forces = values["normal_traction"][steps], values["tangential_traction"][steps]
        moved = values["contact_displacement"][steps]
        moved = moved - values["counterface_displacement"][steps][:, candidates.counterface]
        about_centres = moments(self._bodies.arms(moved), forces)
        points, rotations, turned = candidates.positions + moved, self._system.rotations, None
        if rotations is not None:
            turned = rotations.matrices(self._bodies.rotations(steps))[:, candidates.counterface]
            points = rotations.seen(turned, points, candidates.counterface)
        owners = [candidates.counterface == number for number in range(len(self._system.counterfaces.shapes))]
        for number, owner in enumerate(owners):
            values["counterface_force"][steps, number] = forces[:, owner].sum(axis=1)
            values["counterface_moment"][steps, number] = about_centres[:, owner].sum(axis=1)
        counterface = np.tile(candidates.counterface, len(normal))
        points = points.reshape(-1, self._system.space.dim)
        if self._friction.size:
            frames = self._system.counterfaces.frames(points, counterface).reshape(*forces.shape, points.shape[1])
            forces[:] = np.einsum("...ij,...i->...j", frames[..., 1:, :], self._friction[steps])
            if turned is not None:
                forces[:] = np.einsum("...ij,...j->...i", turned, forces)
        else:
            forces -= normal[..., None] * self._system.counterfaces.normals(points, counterface).reshape(forces.shape)
        for number, owner in enumerate(owners):
            self._complete_utilisation(steps, number, forces[:, owner], self._limits[steps][:, owner])
        forces /= candidates.area[:, None]
        normal /= candidates.area

    def _complete_utilisation(self, steps: slice, number: int, friction: Array, limits: Array) -> None:
        """Compare friction forces (n_steps, k, dim) [N] on a counterface with their limits (n_steps, k) [N]."""
        whole, total = np.linalg.norm(friction.sum(axis=1), axis=-1), limits.sum(axis=1)
        nodal = np.linalg.norm(friction, axis=-1)
        shares = np.divide(nodal, limits, out=np.zeros_like(nodal), where=limits > 0.0)
        self.values["friction_utilisation"][steps, number] = np.divide(
            whole, total, out=np.zeros_like(whole), where=total > 0.0
        )
        self.values["largest_friction_utilisation"][steps, number] = shares.max(axis=1, initial=0.0)


def _strain_histories(
    formulation: Formulation, step: float, material: Elastic, strains: Array, _: NDArray[np.int64]
) -> Relaxed:
    """Return all strains of points (n_times, k, m) [-] at equal steps [s] with their dashpots."""
    return follow_strains(material, strains, formulation, step)


def _first_dimension(name: str) -> str:
    variable = VARIABLES.get(name) or COORDINATES[name]
    return variable.dims[0] if variable.dims else ""
