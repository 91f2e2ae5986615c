"""Receptor sites: where they are in the skin, and which mesh nodes stand for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.anatomy import Fingertip, at_depth, interface_depth, outline_curve
from fingerslip.errors import InputError
from fingerslip.parameters import Length, parameters

__all__ = ["RECEPTOR_KINDS", "Site", "receptor_sites", "site_nodes"]

Floats = NDArray[np.float64]

RECEPTOR_KINDS = ("FA-I", "SA-I", "FA-II", "SA-II")

# FA-II alone have a depth of their own, so they alone can end up in the phalanx.
_MENDS = {
    "FA-II": "the tissue is thinner than receptors.fa_ii_depth there: make that smaller or the tissue thicker, or "
    "leave FA-II out of record.receptors"
}


@parameters
class Site:
    """A place in the fingertip whose signals are recorded.

    Parameters
    ----------
    name : str
        Name in results, such as ``FA-I-07``.
    kind : str
        Receptor type, or any word for a site of one's own.
    position : tuple of float
        Coordinates x, y and in space z [m].
    region : str, optional
        Region on whose side of an interface stresses are taken; any where not given.
    """

    name: str
    kind: str
    position: tuple[Length, ...]
    region: str | None = None


def receptor_sites(fingertip: Fingertip) -> tuple[Site, ...]:
    """Return all candidate receptors of the palmar skin, numbered towards +x within each kind.

    FA-I sit at the tips of the limiting ridges, on the side of the dermis; SA-I at the tips of the intermediate
    ridges, on the side of the epidermis; SA-II just above the dermis-tissue border; FA-II at their depth below the
    skin surface. Where ridges are off, the first two are at the same arc lengths on the plain interface. SA-II and
    FA-II are below every intermediate ridge. Sites fill the zone in which ridges have their full height.

    Parameters
    ----------
    fingertip : Fingertip
        Gives ridges, layers and depths.
    """
    intermediate = _ridges_in_zone(fingertip, shift=0.0)
    limiting = _ridges_in_zone(fingertip, shift=0.5)
    receptors, layers = fingertip.receptors, fingertip.layers
    border = np.full_like(intermediate, layers.skin_thickness - receptors.sa_ii_height)
    deep = np.full_like(intermediate, receptors.fa_ii_depth)
    return (
        *_sites(fingertip, "FA-I", limiting, interface_depth(fingertip, limiting), "dermis"),
        *_sites(fingertip, "SA-I", intermediate, interface_depth(fingertip, intermediate), "epidermis"),
        *_sites(fingertip, "FA-II", intermediate, deep, "tissue"),
        *_sites(fingertip, "SA-II", intermediate, border, "dermis"),
    )


def site_nodes(mesh: skfem.Mesh2D, sites: Sequence[Site]) -> NDArray[np.int64]:
    """Return for each site the nearest mesh node of its region.

    Parameters
    ----------
    mesh : skfem.Mesh2D
        Mesh [m]; a site's region must be one of its named regions.
    sites : sequence of Site
        The sites.

    Returns
    -------
    (sites,) array
        Vertex numbers.

    Raises
    ------
    InputError
        Where a site's region is not in the mesh, or the site is further from its region than one element.
    """
    nodes = np.empty(len(sites), dtype=np.int64)
    for region in {site.region for site in sites}:
        chosen = [number for number, site in enumerate(sites) if site.region == region]
        nodes[chosen] = _nearest(mesh, [sites[number] for number in chosen], _region_cells(mesh, sites[chosen[0]]))
    return nodes


def _ridges_in_zone(fingertip: Fingertip, shift: float) -> Floats:
    """Return the arc lengths (k + shift) pitch at which ridges have their full height."""
    zone, pitch = fingertip.zone, fingertip.ridges.pitch
    first = np.ceil((zone.start + zone.fade) / pitch - shift)
    last = np.floor((zone.end - zone.fade) / pitch - shift)
    arc_length: Floats = (np.arange(first, last + 1) + shift) * pitch
    return arc_length


def _sites(fingertip: Fingertip, kind: str, arc_length: Floats, depth: Floats, region: str) -> list[Site]:
    points = at_depth(outline_curve(fingertip), arc_length, depth)
    return [
        Site(name=f"{kind}-{number:02d}", kind=kind, position=(float(x), float(y)), region=region)
        for number, (x, y) in enumerate(points, start=1)
    ]


def _region_cells(mesh: skfem.Mesh2D, site: Site) -> NDArray[np.int64]:
    regions = mesh.subdomains or {}
    if site.region is None:
        return np.arange(mesh.t.shape[1])
    if site.region not in regions:
        found = f"region '{site.region}' is not in the mesh"
        raise InputError(f"site {site.name}", found, f"it has: {', '.join(regions) or 'no regions'}")
    cells: NDArray[np.int64] = np.asarray(regions[site.region])
    return cells


def _nearest(mesh: skfem.Mesh2D, sites: Sequence[Site], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    corners = mesh.t[:, cells]
    candidates = np.unique(corners)
    for site in sites:
        if len(site.position) != mesh.dim():
            raise InputError(f"site {site.name}", f"got {len(site.position)} coordinates", f"needs {mesh.dim()}")
    distance, match = cKDTree(mesh.p[:, candidates].T).query([site.position for site in sites])
    reach = np.zeros(mesh.p.shape[1])
    edge = np.linalg.norm(mesh.p[:, corners] - mesh.p[:, np.roll(corners, 1, axis=0)], axis=0)
    np.maximum.at(reach, corners.ravel(), np.broadcast_to(edge.max(axis=0), corners.shape).ravel())
    nodes: NDArray[np.int64] = candidates[match]
    outside = np.flatnonzero(distance > reach[nodes])
    if len(outside):
        raise _outside(sites[outside[0]], float(distance[outside[0]]), float(reach[nodes[outside[0]]]))
    return nodes


def _outside(site: Site, distance: float, reach: float) -> InputError:
    place = ", ".join(f"{axis} = {1e3 * value:.4g} mm" for axis, value in zip("xyz", site.position, strict=False))
    found = f"{place} is {distance * 1e3:.3g} mm from the nearest node of "
    found += f"'{site.region}'" if site.region else "the mesh"
    allowed = f"needs <= {reach * 1e3:.3g} mm, the element size there"
    return InputError(f"site {site.name}", found, allowed, _MENDS.get(site.kind, "move it"))
