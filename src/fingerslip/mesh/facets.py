"""Facets, neighbours and nodes of a mesh: facets between regions, where they face, nodes of sites, connected pieces."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import InputError
from fingerslip.sites import Site
from fingerslip.units import coordinates, millimetres

if TYPE_CHECKING:
    import skfem


Integers = NDArray[np.integer]
Mesh = TypeVar("Mesh", bound="skfem.Mesh")


def connected_pieces(count: int, pairs: Integers) -> NDArray[np.int64]:
    """Return the number (count,) of the connected piece of each of `count` things, of which `pairs` (2, k) touch."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(pairs.shape[1]), tuple(pairs)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def with_groups(mesh: Mesh, regions: Mapping[str, Flags], boundaries: Mapping[str, Flags]) -> Mesh:
    """Return a mesh with names for regions and boundaries, by flags of all cells or facets; empty ones get none."""
    tables = [
        {name: np.flatnonzero(flags).astype(np.int32) for name, flags in table.items() if flags.any()}
        for table in (regions, boundaries)
    ]
    return dataclasses.replace(mesh, _subdomains=tables[0], _boundaries=tables[1])


def are_between(mesh: skfem.Mesh, region: Integers, first: int, second: int) -> Flags:
    """Tell which facets (n_facets,) lie between cells of two regions, by each cell's number `region` (n_cells,)."""
    entry, other = region[mesh.f2t]
    between = ((entry == first) & (other == second)) | ((entry == second) & (other == first))
    return np.asarray(between & (mesh.f2t[1] >= 0))


def are_degenerate(mesh: skfem.Mesh) -> Flags:
    """Tell which facets (n_facets,) have no size: between corners of a cell that are one node (:mod:`.mixed`)."""
    different = np.diff(np.sort(mesh.facets, axis=0), axis=0) != 0
    return np.asarray(different.sum(axis=0) < mesh.dim() - 1)


def inner_facets(mesh: skfem.Mesh, boundary: str) -> Integers:
    """Return the facets (k,) of a boundary that lie inside the body, between two cells."""
    facets = np.asarray(mesh.boundaries[boundary])
    return np.asarray(facets[mesh.f2t[1, facets] >= 0])


def outward_normals(mesh: skfem.Mesh, facets: Integers, inside: Integers) -> Floats:
    """Return the unit normals (dim, k) of facets (k,), as if they were flat, away from a cell `inside` (k,) of each."""
    nodes = np.sort(mesh.facets[:, facets], axis=0)
    corners = mesh.p[:, nodes]
    along = corners[:, -1] - corners[:, 0]
    if mesh.dim() == 2:
        normals = np.stack([along[1], -along[0]])
    else:
        # Two corners of a facet may be one node.
        other = np.where(nodes[1] == nodes[0], corners[:, 2], corners[:, 1])
        normals = np.cross(along, other - corners[:, 0], axis=0)
    outward = corners.mean(axis=1) - mesh.p[:, mesh.t[:, inside]].mean(axis=1)
    return np.asarray(normals * np.sign(np.sum(normals * outward, axis=0)) / np.linalg.norm(normals, axis=0))


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
    # Reading a study loads this file, which needs no trees.
    from scipy.spatial import cKDTree

    distance, match = cKDTree(mesh.p[:, candidates].T).query([site.position for site in sites])
    nodes: NDArray[np.int64] = candidates[match].astype(np.int64)
    # The longest edge [m] of the cells at each node.
    around, longest = corners[:, np.isin(corners, nodes).any(axis=0)], np.zeros(mesh.p.shape[1])
    edge = np.linalg.norm(mesh.p[:, around] - mesh.p[:, np.roll(around, 1, axis=0)], axis=0).max(axis=0)
    np.maximum.at(longest, around.ravel(), np.broadcast_to(edge, around.shape).ravel())
    outside = np.flatnonzero(distance > longest[nodes])
    if len(outside):
        site, away, reach = sites[outside[0]], distance[outside[0]], longest[nodes[outside[0]]]
        whole = f"'{site.region}'" if site.region else "the mesh"
        fault = f"{coordinates(site.position)} is {millimetres(float(away), 3)} from the nearest node of {whole}"
        allowed = f"needs <= {millimetres(float(reach), 3)}, the element size there"
        raise InputError(f"site {site.name}", fault, allowed, _REPAIRS.get(site.kind, "move it"))
    return nodes
