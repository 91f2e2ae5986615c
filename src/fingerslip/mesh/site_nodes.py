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


def site_nodes(mesh: skfem.Mesh, sites: Sequence[Site]) -> NDArray[np.int64]:
    """Return for each site the nearest mesh node (n_sites,) of its region."""
    nodes = np.empty(len(sites), dtype=np.int64)
    for region in {site.region for site in sites}:
        chosen = [number for number, site in enumerate(sites) if site.region == region]
        nodes[chosen] = _nearest(mesh, [sites[number] for number in chosen])
    return nodes


def _nearest(mesh: skfem.Mesh, sites: Sequence[Site]) -> NDArray[np.int64]:
    """Return the nearest nodes to sites of one region."""
    region, regions = sites[0].region, mesh.subdomains or {}
    if region is not None and region not in regions:
        allowed = f"it has: {', '.join(regions) or 'no regions'}"
        raise InputError(f"site {sites[0].name}", f"region '{region}' is not in the mesh", allowed)
    for site in sites:
        if len(site.position) != mesh.dim():
            raise InputError(f"site {site.name}", f"got {len(site.position)} coordinates", f"needs {mesh.dim()}")
    corners = mesh.t if region is None else mesh.t[:, regions[region]]
    candidates = np.unique(corners)
    distance, match = cKDTree(mesh.p[:, candidates].T).query([site.position for site in sites])
    nodes: NDArray[np.int64] = candidates[match].astype(np.int64)
    # The longest edge [m] of the cells at each node.
    around, longest = corners[:, np.isin(corners, nodes).any(axis=0)], np.zeros(mesh.p.shape[1])
    edge = np.linalg.norm(mesh.p[:, around] - mesh.p[:, np.roll(around, 1, axis=0)], axis=0).max(axis=0)
    np.maximum.at(longest, around.ravel(), np.broadcast_to(edge, around.shape).ravel())
    outside = np.flatnonzero(distance > longest[nodes])
    if len(outside):
        raise _outside(sites[outside[0]], float(distance[outside[0]]), float(longest[nodes[outside[0]]]))
    return nodes


def _outside(site: Site, distance: float, reach: float) -> InputError:
    position = coordinates(site.position)
    fault = f"{position} is {millimetres(distance, 3)} from the nearest node of "
    fault += f"'{site.region}'" if site.region else "the mesh"
    allowed = f"needs <= {millimetres(reach, 3)}, the element size there"
    return InputError(f"site {site.name}", fault, allowed, _REPAIRS.get(site.kind, "move it"))
