"""When points of the skin slip over the counterface, and how often a slide sticks and slips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN
from fingerslip.history import sites_of_kinds
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import Floats, contact_forces, lags, slide_window, sustained_crossings

if TYPE_CHECKING:
    import xarray as xr

#: Kind of the recorded sites that mark the skin.
EXTERNAL = "external marker"
# A fall of the friction force counts from this share of its largest value in the slide: less is noise of single nodes.
_LEAST_FALL = 0.1
# A marker belongs to the nearest contact node up to this many distances between those nodes.
_BESIDE = 1.5


@dataclass(frozen=True)
class MarkerSlips:
    """When the markers of the skin that touch at the start of a slide begin to slip."""

    names: tuple[str, ...]  # names of their sites
    distance: Floats  # (n,), distance from the one in the middle at rest [m]
    time: Floats  # (n,) [s]


def skin_marker_slips(history: xr.Dataset, settings: EventSettings | None = None) -> MarkerSlips | None:
    """Return when the touching markers of the skin begin to slip in the first slide."""
    settings, window = settings or EventSettings(), slide_window(history)
    rows = sites_of_kinds(history, [EXTERNAL])
    if window is None or not rows.size or not history.sizes.get("contact_node", 0):
        return None
    rows = rows[touching_markers(history)]
    lag = lags(history, window, history["displacement"].values[:, rows], [0])
    times = history["time"].values[window.records]
    crossings = sustained_crossings(times, lag, settings.displacement_tolerance, settings.sustained)
    names = tuple(map(str, history["site"].values[rows]))
    distance = np.linalg.norm(np.delete(history["site_position"].values[rows], 1, axis=1), axis=1)
    return MarkerSlips(names, distance, np.array(crossings, dtype=float))


def touching_markers(history: xr.Dataset) -> NDArray[np.bool_]:
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


def share_before_centre(slips: MarkerSlips | None) -> float | None:
    """Return the share of the outer markers that slip before the central one; None without it or without others."""
    if slips is None:
        return None
    outer = slips.distance > 1e-9
    if outer.all() or not outer.any():
        return None
    centre = np.nan_to_num(slips.time[~outer][0], nan=np.inf)
    return float(np.mean(np.nan_to_num(slips.time[outer], nan=np.inf) < centre))


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
