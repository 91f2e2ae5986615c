"""Record states into the arrays of a history.

A step only copies what the history needs. What follows from it is computed for many steps at once.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.motion import phase_table
from fingerslip.dynamics.scheme import make_scheme
from fingerslip.dynamics.state import State
from fingerslip.dynamics.steps import record_type, snapshot_steps
from fingerslip.dynamics.system import System
from fingerslip.fe.edges import free_edge_distances
from fingerslip.fe.recovery import Recovery, cell_recovery, site_recovery, stress_components, von_mises
from fingerslip.fe.space import cell_nodes, vector_dofs
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.materials.material import STRAIN_COMPONENTS
from fingerslip.model import Model

__all__ = ["CellFields", "Recorder"]

Array = NDArray[np.float64]

_ENERGIES = {
    "kinetic_energy": "kinetic",
    "strain_energy": "strain",
    "contact_energy": "contact",
    "friction_dissipation": "friction",
    "damping_dissipation": "damping",
    "numerical_dissipation": "numerical",
    "external_work": "external_work",
    "energy_imbalance": "imbalance",
}
# Steps whose strains are computed at once, and contact candidates times steps that are completed at once.
_STRAINED_AT_ONCE, _AT_ONCE = 64, 50_000


class CellFields:
    """The recovery of strains in all cells, made when it is first needed.

    Parameters
    ----------
    system : System
        The discrete system.
    """

    def __init__(self, system: System) -> None:
        self._system = system

    @functools.cached_property
    def recovery(self) -> Recovery:
        """The strains of all cells."""
        return cell_recovery(self._system.space, self._system.materials)


class Recorder:
    """Arrays of a history, filled step by step.

    Parameters
    ----------
    model : Model
        What is simulated.
    system : System
        Its discrete system.
    times : (n_times,) array
        Times of the steps, the start included [s].
    cells : CellFields, optional
        Recovery for snapshots; recorders of one mesh may share it.
    """

    def __init__(self, model: Model, system: System, times: Array, cells: CellFields | None = None) -> None:
        self._system, self._times, self._next = system, times, 0
        coordinates, space = system.coordinates, system.space
        self._at_sites = coordinates.components(vector_dofs(system.site_nodes, space.dim).ravel())
        self._at_candidates = coordinates.components(vector_dofs(system.candidates.nodes, space.dim).ravel())
        self._sites = site_recovery(
            space, system.materials, system.site_nodes, [site.region for site in model.record.sites]
        )
        self._at_strained, self._strain_map = coordinates.mapped(self._sites.strain)
        self._strained = np.zeros((min(_STRAINED_AT_ONCE, times.size), self._strain_map.shape[1]))
        self._strains = np.zeros((times.size, len(model.record.sites), STRAIN_COMPONENTS[space.dim]))
        self._scheme, self._damping = make_scheme(model.time), model.damping
        self._held = np.zeros((2, times.size, system.supports.contact.shape[0]))
        self._drives = np.zeros((2, times.size, coordinates.drives.size))
        self._cells = cells or CellFields(system)
        snapshots = snapshot_steps(times, model.record.snapshots_every)
        self._snapshots = {step: number for number, step in enumerate(snapshots)}
        sizes = {
            "time": times.size,
            "site": len(model.record.sites),
            "contact_node": len(system.candidates.nodes),
            "component": system.space.dim,
            "stress_component": len(stress_components(system.space.dim)),
            "counterface": len(model.contacts),
            "support": len(model.supports),
            "snapshot_time": len(self._snapshots),
            "node": len(system.space.positions),
            "cell": system.space.mesh.nelements,
        }
        self.values: dict[str, Any] = {
            name: np.zeros([sizes[dim] for dim in known.dims], dtype=record_type(name))
            for name, known in VARIABLES.items()
            if self._snapshots or "snapshot_time" not in known.dims
        }
        self.values |= _coordinates(model, system, times, times[snapshots])

    @property
    def nbytes(self) -> int:
        """Memory that the arrays take when they are filled [bytes]."""
        return (
            self._strained.nbytes
            + self._strains.nbytes
            + sum(np.asarray(value).nbytes for value in self.values.values())
        )

    def record(self, state: State) -> None:
        """Record the next state."""
        step, self._next = self._next, self._next + 1
        self._record_motion(step, state)
        self._record_contact(step, state)
        self._record_supports(step, state)
        for name, attribute in _ENERGIES.items():
            self.values[name][step] = getattr(state.energies, attribute)
        self.values["contact_iterations"][step] = state.iterations
        self.values["contact_residual"][step] = state.residual
        if (snapshot := self._snapshots.get(step)) is not None:
            self._record_snapshot(snapshot, state)

    def complete(self) -> None:
        """Fill in what follows from the recorded states."""
        self._complete_strains()
        self.values["stress"][:] = self._sites.stresses(self._strains)
        self.values["strain_energy_density"][:] = self._sites.energy_densities(self._strains)
        self._complete_counterfaces()
        self._complete_supports()
        candidates = self._system.candidates
        at_once = max(1, _AT_ONCE // max(1, len(candidates.nodes)))
        for start in range(0, len(self._times), at_once):
            self._complete_tractions(slice(start, start + at_once))

    def _record_motion(self, step: int, state: State) -> None:
        values, drives = self.values, self._system.coordinates.drives
        fields = {"velocity": state.velocity, "acceleration": state.acceleration, "displacement": state.displacement}
        for name, field in fields.items():
            self._at_sites.take(field, values[name][step])
            self._at_candidates.take(field, values[f"contact_{name}"][step])
        row = step % len(self._strained)
        self._at_strained.take(state.displacement, self._strained[row])
        if row == len(self._strained) - 1:
            self._complete_strains()
        self._drives[:, step] = state.displacement[drives], state.velocity[drives]

    def _record_contact(self, step: int, state: State) -> None:
        """Record what the contact did; the arrays of tractions hold forces until they are completed."""
        values, interface = self.values, state.interface
        values["gap"][step] = interface.relative[:, 0]
        values["normal_traction"][step] = interface.forces[:, 0]
        values["tangential_traction"][step] = state.contact_forces
        values["slip_distance"][step] = interface.slip_distance
        values["contact_state"][step] = interface.state
        values["counterface_displacement"][step] = state.counterfaces

    def _record_supports(self, step: int, state: State) -> None:
        """Keep what acts on what supports hold, but for their own forces, and its inertia."""
        supports = self._system.supports
        if not supports.contact.shape[0]:
            return
        strained = state.displacement
        if self._damping.stiffness:
            strained = strained + self._damping.stiffness * state.velocity
        force = supports.stiffness @ strained - supports.load(state.time)
        if self._damping.mass:
            force += self._damping.mass * (supports.mass @ state.velocity)
        self._held[0, step] = force - supports.contact @ state.contact_forces.ravel()
        self._held[1, step] = self._scheme.inertia_factor * (supports.mass @ state.acceleration)

    def _complete_supports(self) -> None:
        """Compute the forces of the supports; see :mod:`fingerslip.dynamics.supports`."""
        force, inertia = self._held
        found = self.values["support_force"].reshape(force.shape)
        unbalance = -inertia[0]
        for step in range(len(force)):
            if step:
                unbalance = (self._scheme.start_weight * unbalance - inertia[step]) / self._scheme.end_weight
            found[step] = force[step] - unbalance

    def _complete_strains(self) -> None:
        """Compute the strains of the last steps, whose displacements are kept."""
        start = (self._next - 1) // len(self._strained) * len(self._strained)
        strains = self._strains[start : self._next]
        strains[:] = (self._strain_map @ self._strained[: len(strains)].T).T.reshape(strains.shape)

    def _complete_counterfaces(self) -> None:
        """Add the motion by the drives, along the normals, to that of the counterfaces."""
        values, shapes = self.values, self._system.counterfaces.shapes
        for column, number in enumerate(self._system.unknowns.driven):
            normal = shapes[number].unit_normal
            values["counterface_displacement"][:, number] += self._drives[0, :, column, None] * normal
            values["counterface_velocity"][:, number] += self._drives[1, :, column, None] * normal

    def _complete_tractions(self, steps: slice) -> None:
        """Sum up the forces in the arrays of tractions, and make tractions of them."""
        values, candidates = self.values, self._system.candidates
        normal, forces = values["normal_traction"][steps], values["tangential_traction"][steps]
        for number in range(len(self._system.counterfaces.shapes)):
            own = candidates.counterface == number
            values["counterface_force"][steps, number] = forces[:, own].sum(axis=1)
        moved = values["contact_displacement"][steps]
        moved = moved - values["counterface_displacement"][steps][:, candidates.counterface]
        points = (candidates.positions + moved).reshape(-1, self._system.space.dim)
        counterface = np.tile(candidates.counterface, len(normal))
        forces -= normal[..., None] * self._system.counterfaces.normals(points, counterface).reshape(forces.shape)
        forces /= candidates.area[:, None]
        normal /= candidates.area

    def _nodal(self, field: Array) -> Array:
        """Return a field on the unknowns (n,) at all nodes, shape (n_nodes, dim)."""
        return self._system.coordinates.on_mesh(field).reshape(-1, self._system.space.dim)

    def _record_snapshot(self, number: int, state: State) -> None:
        values = self.values
        cells = self._cells.recovery
        values["snapshot_velocity"][number] = self._nodal(state.velocity)
        displacement = self._nodal(state.displacement)
        values["snapshot_displacement"][number] = displacement
        strains = cells.strains(displacement.ravel())
        values["snapshot_strain_energy_density"][number] = cells.energy_densities(strains)
        values["snapshot_von_mises"][number] = von_mises(cells.stresses(strains))


def _regions(model: Model) -> NDArray[np.int8]:
    """Return the index of the region of every cell, among all regions; groups without a material do not count."""
    mesh = model.mesh
    regions = np.full(mesh.nelements, -1, dtype=np.int8)
    for number, (name, cells) in enumerate(mesh.subdomains.items()):
        if name in model.materials:
            regions[cells] = number
    return regions


def _edge_distances(model: Model, system: System) -> Array:
    """Return how far each contact candidate is from a free edge of its boundary [m]."""
    candidates = system.candidates
    held = np.ones(system.space.n_dofs, dtype=bool)
    held[system.free] = False
    distances = np.zeros(len(candidates.nodes))
    for number, contact in enumerate(model.contacts):
        own = candidates.counterface == number
        nodes, components = candidates.nodes[own], held.reshape(-1, system.space.dim)
        distances[own] = free_edge_distances(system.space, contact.boundary, components, nodes)
    return distances


def _coordinates(model: Model, system: System, times: Array, snapshot_times: Array) -> dict[str, Any]:
    kinds, knots = phase_table(model.programmes[0])
    sites, counterfaces = model.record.sites, [contact.counterface for contact in model.contacts]
    positions, candidates = system.space.positions, system.candidates
    dim = system.space.dim
    values = {
        "time": times,
        "component": ["x", "y", "z"][:dim],
        "stress_component": list(stress_components(dim)),
        "phase_kind": np.array(kinds, dtype=str),
        "phase_start": knots[:-1],
        "phase_end": knots[1:],
        "site": np.array([site.name for site in sites], dtype=str),
        "site_kind": np.array([site.kind for site in sites], dtype=str),
        "site_region": np.array([site.region or "" for site in sites], dtype=str),
        "site_position": positions[system.site_nodes],
        "counterface": np.array([contact.boundary for contact in model.contacts], dtype=str),
        "support": np.array(list(model.supports), dtype=str),
        "counterface_normal": np.reshape([counterface.unit_normal for counterface in counterfaces], (-1, dim)),
        "counterface_friction_coefficient": np.array([own.friction.coefficient for own in model.contacts], dtype=float),
        "contact_node": candidates.nodes,
        "contact_counterface": candidates.counterface,
        "contact_position": positions[candidates.nodes],
        "contact_area": candidates.area,
        "contact_edge_distance": _edge_distances(model, system),
        "snapshot_time": snapshot_times,
        "node_position": positions,
        "cell_nodes": cell_nodes(system.space),
        "cell_region": _regions(model),
    }
    return {name: values[name] for name in COORDINATES}
