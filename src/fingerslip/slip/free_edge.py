"""Contact that comes close to a free edge of its boundary, where the model cuts the body off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["EdgeContact", "edge_contact", "edge_distance", "edge_warning"]

# Contact within so many facets of a free edge is taken to reach it.
_FACETS = 2.0
# Elements whose sides carry a node in their middle.
_QUADRATIC = {"T6", "T10"}


@dataclass(frozen=True)
class EdgeContact:
    """Contact that came close to a free edge of its boundary."""

    boundary: str  # the boundary that touches
    time: float  # when the contact first came that close [s]
    distance: float  # smallest distance between the contact and the edge [m]


def edge_contact(history: xr.Dataset) -> EdgeContact | None:
    """Find out whether the contact comes within two facets of a free edge of its boundary.

    A free edge is where the boundary meets another free part of the surface, such as the cut end of a fingertip.

    Parameters
    ----------
    history : xarray.Dataset
        A history with ``contact_edge_distance``; one that lacks it has no known edges.

    Returns
    -------
    EdgeContact or None
        The first counterface, in their order, that comes that close; None where all contact keeps away.
    """
    if "contact_edge_distance" not in history.variables:
        return None
    for counterface, boundary in enumerate(history["counterface"].values):
        nodes = np.flatnonzero(history["contact_counterface"].values == counterface)
        near = _near_edge(history, nodes)
        if near.any():
            first = float(history["time"].values[int(near.argmax())])
            return EdgeContact(str(boundary), first, float(_distances(history, nodes).min()))
    return None


def edge_distance(history: xr.Dataset) -> float | None:
    """Return the smallest distance between contact and a free edge of its boundary [m]; None where there is none."""
    if "contact_edge_distance" not in history.variables:
        return None
    distances = _distances(history, np.arange(history.sizes["contact_node"]))
    smallest = float(distances.min(initial=np.inf))
    return smallest if np.isfinite(smallest) else None


def edge_warning(found: Mapping[str, EdgeContact | None]) -> str:
    """Return a warning about the runs whose contact came close to a free edge; empty where none did."""
    cases = [
        f"{title} ('{edge.boundary}' from {edge.time:.3g} s on, smallest distance {1e3 * edge.distance:.3g} mm)"
        for title, edge in found.items()
        if edge is not None
    ]
    if not cases:
        return ""
    return (
        f"Contact within two facets of a free edge of its boundary: {'; '.join(cases)}. The model ends there, so "
        f"forces and slip times are those of a body that is cut off."
    )


def _near_edge(history: xr.Dataset, nodes: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Tell for each record whether one of `nodes` touches within two facets of an edge."""
    close = history["contact_edge_distance"].values[nodes] <= _FACETS * _facet_size(history, nodes)
    touching: NDArray[np.bool_] = (history["contact_state"].values[:, nodes[close]] != OPEN).any(axis=1)
    return touching


def _distances(history: xr.Dataset, nodes: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the distances from an edge of those of `nodes` that touch at any time [m]."""
    touched = (history["contact_state"].values[:, nodes] != OPEN).any(axis=0)
    return np.asarray(history["contact_edge_distance"].values[nodes[touched]], dtype=float)


def _facet_size(history: xr.Dataset, nodes: NDArray[np.intp]) -> float:
    """Return the typical size of the facets between `nodes`: how far apart neighbours are [m]."""
    from scipy.spatial import cKDTree

    if nodes.size < 2:
        return 0.0
    apart, _ = cKDTree(history["contact_position"].values[nodes]).query(history["contact_position"].values[nodes], k=2)
    return float(np.median(apart[:, 1])) * (2.0 if history.attrs.get("element") in _QUADRATIC else 1.0)
