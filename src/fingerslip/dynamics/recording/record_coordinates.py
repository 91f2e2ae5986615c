"""What a history says of the model and its mesh: the coordinates of its records."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.system.bodies import body_centres
from fingerslip.dynamics.system.motion import phase_table
from fingerslip.dynamics.system.system import System
from fingerslip.fe.recovery import stress_components
from fingerslip.fe.space import cell_nodes, free_edge_distances
from fingerslip.history import COORDINATES
from fingerslip.model.model import Model

__all__ = ["record_coordinates", "rotation_axes"]

Array = NDArray[np.float64]


def rotation_axes(dim: int) -> list[str]:
    """Return the names of the axes about which bodies turn."""
    return ["z"] if dim == 2 else ["x", "y", "z"]


def record_coordinates(model: Model, system: System, times: Array, snapshot_times: Array) -> dict[str, Any]:
    """Return the coordinates of a history, by their names in :data:`fingerslip.history.COORDINATES`.

    Arrays: times, snapshot_times (n,) [s].
    """
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
        "rotation_axis": rotation_axes(dim),
        "rigid_body": np.array(list(model.bodies), dtype=str),
        "rigid_body_centre": body_centres(model)[0],
        "support": np.array(list(model.supports), dtype=str),
        "counterface_normal": np.reshape([counterface.unit_normal for counterface in counterfaces], (-1, dim)),
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


def _edge_distances(model: Model, system: System) -> Array:
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
