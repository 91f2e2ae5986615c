"""The mesh nodes that stand for sites."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.sites import Site
from fingerslip.units import coordinates, millimetres

# FA-II alone have a depth of their own, so they alone can end up in the phalanx.
_REPAIRS = {
    "FA-II": "the tissue is thinner than receptors.fa_ii_depth there: make that smaller or the tissue thicker, or "
    "leave FA-II out of record.receptors"
}


def site_nodes(mesh: skfem.Mesh2D, sites: Sequence[Site]) -> NDArray[np.int64]:
    """Return for each site the nearest mesh node of its region.

    Arrays: mesh [m]; returns (sites,).
    """
    nodes = np.empty(len(sites), dtype=np.int64)
    for region in {site.region for site in sites}:
        chosen = [number for number, site in enumerate(sites) if site.region == region]
        nodes[chosen] = _nearest(mesh, [sites[number] for number in chosen], _region_cells(mesh, sites[chosen[0]]))
    return nodes


def _region_cells(mesh: skfem.Mesh2D, site: Site) -> NDArray[np.int64]:
    regions = mesh.subdomains or {}
    if site.region is None:
        return np.arange(mesh.t.shape[1])
    if site.region not in regions:
        fault = f"region '{site.region}' is not in the mesh"
        raise InputError(f"site {site.name}", fault, f"it has: {', '.join(regions) or 'no regions'}")
    cells: NDArray[np.int64] = np.asarray(regions[site.region])
    return cells


def _nearest(mesh: skfem.Mesh2D, sites: Sequence[Site], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    corners = mesh.t[:, cells]
    candidates = np.flatnonzero(_among(mesh, corners))
    for site in sites:
        if len(site.position) != mesh.dim():
            raise InputError(f"site {site.name}", f"got {len(site.position)} coordinates", f"needs {mesh.dim()}")
    distance, match = cKDTree(mesh.p[:, candidates].T).query([site.position for site in sites])
    nodes: NDArray[np.int64] = candidates[match]
    reach = _longest_edges(mesh, corners[:, _among(mesh, nodes)[corners].any(axis=0)])[nodes]
    outside = np.flatnonzero(distance > reach)
    if len(outside):
        raise _outside(sites[outside[0]], float(distance[outside[0]]), float(reach[outside[0]]))
    return nodes


def _among(mesh: skfem.Mesh2D, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which of all nodes are among some (any shape), shape (n_nodes,)."""
    mask = np.zeros(mesh.p.shape[1], dtype=bool)
    mask[nodes] = True
    return mask


def _longest_edges(mesh: skfem.Mesh2D, corners: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the longest edge [m] of the cells with some corners (k, n) at each of all nodes, shape (n_nodes,)."""
    longest = np.zeros(mesh.p.shape[1])
    edge = np.linalg.norm(mesh.p[:, corners] - mesh.p[:, np.roll(corners, 1, axis=0)], axis=0)
    np.maximum.at(longest, corners.ravel(), np.broadcast_to(edge.max(axis=0), corners.shape).ravel())
    return longest


def _outside(site: Site, distance: float, reach: float) -> InputError:
    position = coordinates(site.position)
    fault = f"{position} is {millimetres(distance, 3)} from the nearest node of "
    fault += f"'{site.region}'" if site.region else "the mesh"
    allowed = f"needs <= {millimetres(reach, 3)}, the element size there"
    return InputError(f"site {site.name}", fault, allowed, _REPAIRS.get(site.kind, "move it"))
