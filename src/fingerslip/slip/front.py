"""Readings of slip that converge with the mesh: the slip front at receptors, and friction as a share of its limit.

Neither takes part in the slip events or in the validation; both are there for comparisons of a reader's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN
from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.sites import Site
from fingerslip.slip.counterface import contact_forces, slide_tangent
from fingerslip.slip.fractions import accumulated_slip
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import SlideWindow, slide_window, sustained_crossing, sustained_crossings

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["force_ratio_times", "front_arrivals"]

Floats = NDArray[np.float64]


def front_arrivals(
    history: xr.Dataset,
    kinds: Sequence[str] = ("FA-I",),
    settings: EventSettings | None = None,
    slide: int = 0,
    sites: Sequence[Site] | None = None,
) -> xr.DataArray:
    """Return when the slip front arrives at the receptors above the contact of a section.

    The front is at a contact node once the node has slipped by more than `slip_tolerance` since the slide began, for
    the time `sustained` or up to the end of the slide. Between two nodes the time is interpolated along the contact,
    so it belongs to a point of the skin and not to a node of the mesh.

    Parameters
    ----------
    history : xarray.Dataset
        A two-dimensional history with receptors.
    kinds : sequence of str, optional
        Receptor types.
    settings : EventSettings, optional
        Tolerance, and how long the slip has to last.
    slide : int, optional
        Which of the slides, from 0.
    sites : sequence of Site, optional
        Receptors to take where they were meant to be, such as those of :func:`~fingerslip.receptor_sites`; without them
        the recorded ones, which stand at the nearest nodes of the mesh. To compare meshes, give the sites.

    Returns
    -------
    xarray.DataArray
        Times [s], dimension site, from the one end of the contact to the other: the receptors that lie between the
        outermost nodes in contact at the start of the slide. NaN (missing) where the front does not arrive; no site
        where there is no slide, or the history is one in space.
    """
    settings = settings or EventSettings()
    window = slide_window(history, slide)
    names, positions = _receptors(history, kinds, sites)
    if window is None or is_solid(history) or not names:
        return _arrivals((), np.empty(0))
    along, reached = _node_times(history, window, settings)
    at = positions @ slide_tangent(history)
    inside = np.flatnonzero((at >= along[0]) & (at <= along[-1])) if along.size else np.empty(0, dtype=np.intp)
    order = inside[np.argsort(at[inside], kind="stable")]
    times = np.interp(at[order], along, reached) if order.size else np.empty(0)
    return _arrivals([names[index] for index in order], times)


def force_ratio_times(
    history: xr.Dataset,
    fractions: Sequence[float] = (0.5, 0.9),
    settings: EventSettings | None = None,
    slide: int = 0,
    counterface: int = 0,
) -> tuple[float | None, ...]:
    """Return when the friction force reaches given shares of its limit in a slide.

    The limit is the friction coefficient times the normal force, each of the whole counterface.

    Parameters
    ----------
    history : xarray.Dataset
        A history with contact.
    fractions : sequence of float, optional
        Shares of the limit [-].
    settings : EventSettings, optional
        How long the share has to last (`sustained`).
    slide : int, optional
        Which of the slides, from 0.
    counterface : int, optional
        The counterface.

    Returns
    -------
    tuple of float or None
        A time [s] for each share, interpolated between records; None for one that is not reached, and for all where
        nothing slides or there is no friction.
    """
    window = slide_window(history, slide)
    if window is None or history.sizes.get("counterface", 0) <= counterface:
        return (None,) * len(fractions)
    coefficient = float(history["counterface_friction_coefficient"].values[counterface])
    if not coefficient > 0.0:
        return (None,) * len(fractions)
    times, sustained = history["time"].values[window.records], (settings or EventSettings()).sustained
    share = contact_forces(history, counterface).ratio()[window.records] / coefficient
    return tuple(sustained_crossing(times, share, fraction, sustained) for fraction in fractions)


def _receptors(history: xr.Dataset, kinds: Sequence[str], sites: Sequence[Site] | None) -> tuple[list[str], Floats]:
    """Return names and positions (n, dim) of the receptors of some kinds."""
    if sites is not None:
        chosen = [site for site in sites if site.kind in kinds]
        return [site.name for site in chosen], np.array([site.position for site in chosen], dtype=float)
    rows = sites_of_kinds(history, kinds)
    if rows.size == 0:
        return [], np.empty((0, 2))
    return [str(name) for name in history["site"].values[rows]], history["site_position"].values[rows]


def _node_times(history: xr.Dataset, window: SlideWindow, settings: EventSettings) -> tuple[Floats, Floats]:
    """Return position along the contact and arrival of the nodes in contact at the start of the slide, both (n,)."""
    touching = np.flatnonzero(history["contact_state"].values[window.first] != OPEN)
    times, slip = history["time"].values[window.records], accumulated_slip(history, window)
    crossings = sustained_crossings(times, slip[:, touching], settings.slip_tolerance, settings.sustained)
    reached = np.array([np.nan if time is None else time for time in crossings], dtype=float)
    along = np.asarray(history["contact_position"].values[touching] @ slide_tangent(history), dtype=float)
    order = np.argsort(along)
    return along[order], reached[order]


def _arrivals(names: Sequence[str], times: Floats) -> xr.DataArray:
    import xarray as xr

    attributes = {"units": "s", "long_name": "arrival of the slip front"}
    return xr.DataArray(times, {"site": list(names)}, ("site",), "front_arrival", attributes)
