"""Slip at places of the skin: the front at receptors, reference nodes, markers; friction as a share of its limit.

Front and share converge with the mesh. Neither takes part in the slip events or in the validation; both are there for
comparisons of a reader's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.contact.states import OPEN
from fingerslip.history import is_solid, site_rows, sites_of_kinds
from fingerslip.libraries import xr
from fingerslip.sites import Site
from fingerslip.slip import windows
from fingerslip.slip.events import SlipEvents, events_of_leaving
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import contact_forces, lags, slide_window, sustained_crossings


def front_arrivals(
    history: xr.Dataset,
    kinds: Sequence[str] = ("FA-I",),
    settings: EventSettings | None = None,
    slide: int = 0,
    sites: Sequence[Site] | None = None,
) -> xr.DataArray:
    """Return when the slip front arrives at the receptors above the contact of a section, (n,) by site [s].

    The front is at a contact node once the node has slipped by more than `slip_tolerance` since the slide began, for
    the time `sustained` or up to the end of the slide. Between two nodes the time is interpolated along the contact,
    so it belongs to a point of the skin and not to a node of the mesh. Receptors lie between the outermost nodes in
    contact at the start of the slide, in order; NaN (missing) where the front does not arrive, no site where there is
    no slide, or the history is one in 3D. To compare meshes, give the `sites` where they were meant to be: the recorded
    ones stand at the nearest nodes.
    """
    settings, window = settings or EventSettings(), slide_window(history, slide)
    names, positions = _receptors(history, kinds, sites)
    order, times = np.empty(0, dtype=np.intp), np.empty(0)
    if window is not None and not is_solid(history) and names.size:
        # Position along the contact, and arrival, of the nodes in contact at the start of the slide.
        touching = np.flatnonzero(history["contact_state"].values[window.first] != OPEN)
        slip, records = windows.accumulated_slip(history, window)[:, touching], history["time"].values[window.records]
        crossings = sustained_crossings(records, slip, settings.slip_tolerance, settings.sustained)
        tangent = windows.slide_tangent(history)
        along, at = history["contact_position"].values[touching] @ tangent, positions @ tangent
        inside = np.flatnonzero((at >= along.min(initial=np.inf)) & (at <= along.max(initial=-np.inf)))
        order, nodes = inside[np.argsort(at[inside], kind="stable")], np.argsort(along)
        if order.size:
            times = np.interp(at[order], along[nodes], np.array(crossings, dtype=float)[nodes])
    attributes = {"units": "s", "long_name": "arrival of the slip front"}
    return xr.DataArray(times, {"site": names[order].tolist()}, ("site",), "front_arrival", attributes)


def force_ratio_times(
    history: xr.Dataset,
    fractions: Sequence[float] = (0.5, 0.9),
    settings: EventSettings | None = None,
    slide: int = 0,
    counterface: int = 0,
) -> tuple[float | None, ...]:
    """Return when the friction force reaches given shares [-] of its limit in a slide [s].

    The limit is the friction coefficient times the normal force, each of the whole counterface, and a share has to last
    for `sustained`; times are interpolated between records. None for one that is not reached, and for all where nothing
    slides or there is no friction.
    """
    window = slide_window(history, slide)
    if window is None or history.sizes.get("counterface", 0) <= counterface:
        return (None,) * len(fractions)
    coefficient = float(history["counterface_friction_coefficient"].values[counterface])
    if not coefficient > 0.0:
        return (None,) * len(fractions)
    times, sustained = history["time"].values[window.records], (settings or EventSettings()).sustained
    share = contact_forces(history, counterface).ratio()[window.records] / coefficient
    return tuple(windows.sustained_crossing(times, share, fraction, sustained) for fraction in fractions)


def _receptors(
    history: xr.Dataset, kinds: Sequence[str], sites: Sequence[Site] | None
) -> tuple[NDArray[np.str_], Floats]:
    """Return names (n,) and positions (n, dim) of the receptors of some kinds."""
    if sites is None:
        rows = sites_of_kinds(history, kinds)
        if not rows.size:
            return np.empty(0, dtype=np.str_), np.empty((0, 2))
        return history["site"].values[rows].astype(np.str_), history["site_position"].values[rows]
    chosen = [site for site in sites if site.kind in kinds]
    return np.array([site.name for site in chosen], dtype=np.str_), np.array([site.position for site in chosen])


def reference_events(
    history: xr.Dataset,
    sites: Sequence[str],
    settings: EventSettings | None = None,
    slide: int = 0,
    counterface: int = 0,
) -> SlipEvents:
    """Find the events from sites of the skin that leave the plate's line in a plot of displacement over time.

    A site has left the line where it lags by `displacement_tolerance` for the time `sustained`; all should be in
    contact when the slide begins. The events are when the first site, 48 % of them, three quarters and the last one
    left the line, without recorded events where the history lacks one of the sites.
    """
    settings = settings or EventSettings()
    available = set(history["site"].values.tolist()) if "site" in history.coords else set()
    if not sites or not available.issuperset(sites) or "displacement" not in history:
        return SlipEvents(recorded=False)
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    moved, times = history["displacement"].values[:, site_rows(history, sites)], history["time"].values[window.records]
    behind = lags(history, window, moved, [counterface])
    crossings = sustained_crossings(times, behind, settings.displacement_tolerance, settings.sustained)
    return events_of_leaving(crossings, settings)


# Contact within so many facets of a free edge is taken to reach it.
_FACETS = 2.0
_MOST_NAMED = 3  # runs in a sentence
# Elements whose sides carry a node in their middle.
_QUADRATIC = {"T6", "T10"}


@dataclass(frozen=True)
class EdgeContact:
    """Contact that came close to a free edge of its boundary."""

    boundary: str  # the boundary that touches
    time: float  # when the contact first came that close [s]
    distance: float  # smallest distance between the contact and the edge [m]


def edge_contact(history: xr.Dataset) -> EdgeContact | None:
    """Return the first counterface whose contact comes within two facets of a free edge of its boundary.

    A free edge is where the boundary meets another free part of the surface, such as the cut end of a fingertip. None
    where all contact keeps away, or the history has no ``contact_edge_distance``.
    """
    if "contact_edge_distance" not in history.variables:
        return None
    for counterface, boundary in enumerate(history["counterface"].values):
        nodes = np.flatnonzero(history["contact_counterface"].values == counterface)
        # Records at which one of the nodes touches within two facets of an edge.
        close = history["contact_edge_distance"].values[nodes] <= _FACETS * facet_size(history, nodes)
        near = (history["contact_state"].values[:, nodes[close]] != OPEN).any(axis=1)
        if near.any():
            first = float(history["time"].values[int(near.argmax())])
            return EdgeContact(str(boundary), first, float(_distances(history, nodes).min()))
    return None


def edge_distance(history: xr.Dataset) -> float | None:
    """Return the smallest distance between contact and a free edge of its boundary [m]; None where there is none."""
    if "contact_edge_distance" not in history.variables:
        return None
    distances = _distances(history, slice(None))
    return float(distances.min()) if np.isfinite(distances).any() else None


def edge_warning(edges: Mapping[str, EdgeContact | None]) -> str:
    """Return a warning about the runs whose contact came close to a free edge; empty where none did."""
    cases = [
        f"{title} ('{edge.boundary}' from {edge.time:.3g} s on, smallest distance {1e3 * edge.distance:.3g} mm)"
        for title, edge in edges.items()
        if edge is not None
    ]
    consequence = "The model ends there, so forces and slip times are those of a body that is cut off."
    listed = "; ".join(cases[:_MOST_NAMED]) + f" and {len(cases) - _MOST_NAMED} more" * (len(cases) > _MOST_NAMED)
    return f"Contact within two facets of a free edge of its boundary: {listed}. {consequence}" * bool(cases)


def _distances(history: xr.Dataset, nodes: NDArray[np.intp] | slice) -> Floats:
    """Return the distances from an edge of those of `nodes` that touch at any time [m]."""
    touched = (history["contact_state"].values[:, nodes] != OPEN).any(axis=0)
    return np.asarray(history["contact_edge_distance"].values[nodes][touched], dtype=float)


def facet_size(history: xr.Dataset, nodes: NDArray[np.intp]) -> float:
    """Return the typical size of the facets between `nodes`: how far apart neighbours are [m]."""
    from scipy.spatial import cKDTree

    if nodes.size < 2:
        return 0.0
    apart, _ = cKDTree(history["contact_position"].values[nodes]).query(history["contact_position"].values[nodes], k=2)
    return float(np.median(apart[:, 1])) * (2.0 if history.attrs.get("element") in _QUADRATIC else 1.0)


#: Kind of the recorded sites that mark the skin.
EXTERNAL = "external marker"
# A fall of the friction force counts from this share of its largest value in the slide: less is noise of single nodes.
_LEAST_FALL = 0.1
# A marker belongs to the nearest contact node up to this many distances between those nodes.
_BESIDE = 1.5


def skin_marker_slips(history: xr.Dataset) -> tuple[NDArray[np.intp], Floats]:
    """Return the rows of the touching markers of the skin and when they begin to slip in the first slide [s], (n,)."""
    settings, window = EventSettings(), slide_window(history)
    rows = sites_of_kinds(history, [EXTERNAL])[touching_markers(history)]
    if window is None or not rows.size:
        return rows, np.empty(0)
    lag = lags(history, window, history["displacement"].values[:, rows], [0])
    times = history["time"].values[window.records]
    crossings = sustained_crossings(times, lag, settings.displacement_tolerance, settings.sustained)
    return rows, np.array(crossings, dtype=float)


def touching_markers(history: xr.Dataset) -> Flags:
    """Tell of each marker of the skin, in the order of the sites, whether it touches when the first slide begins.

    It is at, or on quadratic facets beside, a node that is in contact then.
    """
    rows, window = sites_of_kinds(history, [EXTERNAL]), slide_window(history)
    if window is None or not rows.size or history.sizes.get("contact_node", 0) < 2:
        return np.zeros(rows.size, dtype=bool)
    # Slow to import as well, see `stick_slip_cycles`.
    from scipy.spatial import cKDTree

    nodes, state = history["contact_position"].values, history["contact_state"].values[window.first]
    tree = cKDTree(nodes)
    away, nearest = tree.query(history["site_position"].values[rows])
    # The corners of quadratic facets bear no contact force, the nodes between them do.
    beside: float = _BESIDE * float(np.median(tree.query(nodes, k=2)[0][:, 1]))
    return np.asarray((away < beside) & (state[nearest] != OPEN))


def share_before_centre(history: xr.Dataset) -> float | None:
    """Return the share of the outer touching markers that slip before the central one; None where one of both lacks."""
    rows, slips = skin_marker_slips(history)
    if not rows.size:
        return None
    outer = np.linalg.norm(np.delete(history["site_position"].values[rows], 1, axis=1), axis=1) > 1e-9
    if outer.all() or not outer.any():
        return None
    times = np.nan_to_num(slips, nan=np.inf)
    return float(np.mean(times[outer] < times[~outer][0]))


def stick_slip_cycles(history: xr.Dataset) -> int | None:
    """Return how often friction builds up and falls in the first slide; None where there is no slide.

    A fall counts where the force loses a tenth of its largest value in the slide, or more.
    """
    window = slide_window(history)
    if window is None or not history.sizes.get("counterface", 0):
        return None
    friction = contact_forces(history).friction[window.records]
    largest = float(friction.max(initial=0.0))
    if largest <= 0.0:
        return 0
    # scipy.signal is slow to import, and study files are read without it.
    from scipy.signal import find_peaks

    least, count, last = _LEAST_FALL * largest, 0, None
    for peak in find_peaks(friction)[0]:
        # How far the force falls behind the peak before it is as large again.
        again = np.flatnonzero(friction[peak + 1 :] > friction[peak])
        behind = friction[peak:] if not again.size else friction[peak : peak + again[0] + 1]
        if friction[peak] - behind.min() < least:
            continue
        if last is None or friction[last] - friction[last : peak + 1].min() >= least:
            count, last = count + 1, peak
        elif friction[peak] > friction[last]:
            last = peak
    return count
