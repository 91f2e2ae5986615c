"""What a history says of its model: its coordinates, and what made it."""

from __future__ import annotations

import logging
import platform
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.candidates import counterface_outlines
from fingerslip.contact.states import OPEN
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.bodies import body_centres, phase_table
from fingerslip.dynamics.system.scheme import hht
from fingerslip.dynamics.system.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.fe.recovery import stress_components
from fingerslip.fe.space import cell_nodes, free_edge_distances
from fingerslip.history import COORDINATES, make_history
from fingerslip.libraries import xr
from fingerslip.model.model import Model
from fingerslip.parameters import key_of
from fingerslip.units import millimetres
from fingerslip.version import __version__


def record_coordinates(model: Model, system: System, times: Floats, snapshot_times: Floats) -> dict[str, Any]:
    """Return the coordinates of a history, by their names in :data:`fingerslip.history.COORDINATES`."""
    kinds, knots = phase_table(model.programmes[0] or model.programme)
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
        "rotation_axis": ["z"] if dim == 2 else ["x", "y", "z"],
        "rigid_body": np.array(list(model.bodies), dtype=str),
        "rigid_body_centre": body_centres(model)[0],
        "support": np.array(list(model.supports), dtype=str),
        "counterface_normal": np.reshape([counterface.unit_normal for counterface in counterfaces], (-1, dim)),
        "counterface_shape": np.array([key_of(type(counterface)) for counterface in counterfaces], dtype=str),
        "counterface_outline": counterface_outlines(system.counterfaces.shapes, candidates, system.size),
        "counterface_rigid_body": np.array([contact.rigid_body or "" for contact in model.contacts], dtype=str),
        "counterface_friction_coefficient": np.array(
            [element.friction.coefficient for element in model.contacts], dtype=float
        ),
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


def _regions(model: Model) -> NDArray[np.int8]:
    """Return the index of the region of every cell, among all regions; groups without a material do not count."""
    mesh = model.mesh
    regions = np.full(mesh.nelements, -1, dtype=np.int8)
    for number, (name, cells) in enumerate(mesh.subdomains.items()):
        if name in model.materials:
            regions[cells] = number
    return regions


def _edge_distances(model: Model, system: System) -> Floats:
    """Return how far each contact candidate is from a free edge of its boundary [m]."""
    candidates = system.candidates
    held = np.ones(system.space.n_dofs, dtype=bool)
    held[system.free] = False
    distances = np.zeros(len(candidates.nodes))
    for number, contact in enumerate(model.contacts):
        rows = candidates.counterface == number
        nodes, components = candidates.nodes[rows], held.reshape(-1, system.space.dim)
        distances[rows] = free_edge_distances(system.space, contact.boundary, components, nodes)
    return distances


# Share of the largest energy that steps may make without a warning; that of the shipped studies is below 1e-4.
_MADE_ENERGY = 0.01
_ZERO_GAP = 1e-9  # m

_logger = logging.getLogger("fingerslip.dynamics")


def labelled_history(
    values: Mapping[str, Any], stepper: Stepper, attributes: Mapping[str, object], watch: Stopwatch
) -> xr.Dataset:
    """Label records as a history, and warn where its steps have made energy, or nothing touched in a whole one."""
    history = make_history(values, _provenance(stepper, attributes, watch))
    if "failure" in attributes:
        return history
    _check_made_energy(history, stepper)
    states, gaps = history["contact_state"].values, history["gap"].values
    for number, boundary in enumerate(history["counterface"].values):
        nodes = history["contact_counterface"].values == number
        # What starts at a gap of zero may wait for a command that closes it.
        if nodes.any() and (states[:, nodes] == OPEN).all() and gaps[:, nodes].min() > _ZERO_GAP:
            repair = "let it start nearer, move it further, or turn its normal towards the body"
            gap = millimetres(float(gaps[:, nodes].min()))
            _logger.warning(
                "contacts.%d: never touches '%s'; the smallest gap is %s: %s", number, boundary, gap, repair
            )
    return history


def _check_made_energy(history: xr.Dataset, stepper: Stepper) -> None:
    """Warn where steps have made energy, as those of a user's own scheme can; refuse more than the work done."""
    # Without inertia there is no motion that could take up energy: what is booked there is the error of a large step.
    if not history["kinetic_energy"].values.any():
        return
    energy, share = made_energy(history)
    work = float(np.abs(history["external_work"].values).max())
    work += sum(float(history[name].values[0]) for name in ("kinetic_energy", "strain_energy"))
    # What the model does not have already.
    remedies = ["a smaller step"]
    if stepper.system.candidates.nodes.size:
        remedies.append("softer contact penalties")
    if stepper.scheme != hht(stepper.scheme.step, stepper.scheme.start_weight):
        remedies.append("the scheme TimeStepping, whose impacts make none")
    advice = f"take {' or '.join(remedies)}"
    if energy > work:
        problem = f"steps that have made {energy:.3g} J, more than the {work:.3g} J put in,"
        ratio = energy / work if work else np.inf
        error = ConvergenceError(float(history["time"][-1]), -1, ratio, 1.0, advice, problem)
        error.history = history.assign_attrs(failure=str(error))
        raise error
    if share > _MADE_ENERGY:
        history.attrs["doubt"] = (
            f"time steps have made {energy:.3g} J, {100 * share:.0f} % of the largest energy: {advice}"
        )
        _logger.warning("%s", history.attrs["doubt"])


def made_energy(history: xr.Dataset) -> tuple[float, float]:
    """Return how much energy the steps of a motion have made, in J and as a share of the largest energy.

    That is how far friction and numerical dissipation together, or damping, accumulated, fall below what they have
    been.
    """
    of_steps = history["friction_dissipation"].values + history["numerical_dissipation"].values
    dissipated = np.stack([of_steps, history["damping_dissipation"].values])
    gained = float((np.maximum.accumulate(dissipated, axis=1) - dissipated).max(initial=0.0))
    names = ("kinetic_energy", "strain_energy", "external_work")
    largest = max(float(np.abs(history[name].values).max(initial=0.0)) for name in names)
    return gained, gained / largest if largest > 0.0 else 0.0


def _provenance(stepper: Stepper, attributes: Mapping[str, object], watch: Stopwatch) -> dict[str, object]:
    """Return what made the history: versions, solver, basis, sizes and seconds."""
    system = stepper.system
    return {
        "title": "fingerslip history",
        "fingerslip_version": __version__,
        "python_version": platform.python_version(),
        "kinematics": "small" if system.body is None else "finite",
        "formulation": system.materials.formulation,
        "linear_solver": stepper.solver.name,
        "condensation": stepper.condensed.description,
        **attributes,
        "element": system.space.element,
        "regions": ", ".join(system.space.mesh.subdomains or {}),
        "n_degrees_of_freedom": len(system.free),
        "n_nodes": len(system.space.positions),
        "n_contact_candidates": len(system.candidates.nodes),
        "normal_penalty": _mean_penalty(system.candidates.normal_stiffness, system.candidates.area),
        "tangential_penalty": _mean_penalty(system.candidates.tangential_stiffness, system.candidates.area),
        **{f"seconds_{name}": value for name, value in watch.seconds.items()},
        **{f"cpu_seconds_{name}": value for name, value in watch.cpu_seconds.items()},
    }


def _mean_penalty(stiffness: Floats, area: Floats) -> float:
    return float(stiffness.sum() / area.sum()) if area.size else 0.0
