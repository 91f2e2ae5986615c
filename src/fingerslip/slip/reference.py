"""Slip events from named sites that no longer move with the plate, such as reference nodes of a fingertip in space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.history import site_rows
from fingerslip.slip.counterface import counterface_normal, split_along
from fingerslip.slip.events import SlipEvents, events_of_leaving
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import SlideWindow, slide_window, sustained_crossings

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["reference_events"]


def reference_events(
    history: xr.Dataset,
    sites: Sequence[str],
    settings: EventSettings | None = None,
    slide: int = 0,
    counterface: int = 0,
) -> SlipEvents:
    """Find the events from sites of the skin that leave the plate's line in a plot of displacement over time.

    Parameters
    ----------
    history : xarray.Dataset
        A history that records these sites.
    sites : sequence of str
        Names of sites on the skin, such as ``skin-h2``; all should be in contact when the slide begins.
    settings : EventSettings, optional
        Distance from which a site has left the line (`displacement_tolerance`), and how long it has to last.
    slide : int, optional
        Which of the slides, from 0.
    counterface : int, optional
        The counterface.

    Returns
    -------
    SlipEvents
        When the first site, 48 % of them, three quarters and the last one left the line; without recorded events
        where the history lacks one of the sites.
    """
    settings = settings or EventSettings()
    known = set(history["site"].values.tolist()) if "site" in history.coords else set()
    if not sites or not known.issuperset(sites) or "displacement" not in history:
        return SlipEvents(recorded=False)
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    times = history["time"].values[window.records]
    lags = _lags(history, window, sites, counterface)
    level, sustained = settings.displacement_tolerance, settings.sustained
    return events_of_leaving(sustained_crossings(times, lags, level, sustained), settings)


def _lags(history: xr.Dataset, window: SlideWindow, sites: Sequence[str], counterface: int) -> NDArray[np.float64]:
    """Return how far sites have moved along the plate, relative to it, in the slide; (n_times, n_sites) [m]."""
    skin = history["displacement"].values[window.records][:, site_rows(history, sites)]
    plate = history["counterface_displacement"].values[window.records][:, [counterface]]
    _, along = split_along((skin - skin[0]) - (plate - plate[0]), counterface_normal(history, counterface))
    return np.asarray(np.linalg.norm(along, axis=-1), dtype=float)
