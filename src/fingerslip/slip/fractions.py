"""How much of the contact area is slipping, and how much has slipped since the slide began."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP
from fingerslip.slip.windows import SlideWindow, split_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "accumulated_slip",
    "area_fraction",
    "contact_area",
    "relative_displacement",
    "slipped_fraction",
    "slipping_fraction",
    "stick_ratio",
]


def contact_area(history: xr.Dataset) -> xr.DataArray:
    """Return the area in contact over time, shape (n_times,): tributary areas of all nodes that are not open [m^2]."""
    area = (history["contact_state"].values != OPEN) @ history["contact_area"].values
    return _series(history["time"], area, "contact_area", "area in contact").assign_attrs(units="m^2")


def slipping_fraction(history: xr.Dataset) -> xr.DataArray:
    """Return the area fraction of the contact that slips at each time.

    Units: returns [-].
    """
    state = history["contact_state"].values
    fraction = area_fraction(state == SLIP, state != OPEN, history["contact_area"].values)
    return _series(history["time"], fraction, "slipping_fraction", "slipping area fraction")


def stick_ratio(history: xr.Dataset) -> xr.DataArray:
    """Return the stick ratio, shape (n_times,): sticking over contact area [-], missing while nothing touches."""
    return (1.0 - slipping_fraction(history)).rename("stick_ratio").assign_attrs(units="1", long_name="stick ratio")


def slipped_fraction(history: xr.Dataset, window: SlideWindow, tolerance: float) -> xr.DataArray:
    """Return the area fraction that has slipped by more than a tolerance since the slide began.

    Only nodes that were in contact when the slide began, and still are, are weighed: skin that rolls
    onto the plate during the slide is new there and could not slip yet.

    Units: tolerance [m]; returns [-].
    """
    touching = history["contact_state"].values[window.records] != OPEN
    counted = touching & touching[0]
    slipped = accumulated_slip(history, window) > tolerance
    fraction = area_fraction(slipped & counted, counted, history["contact_area"].values)
    times = history["time"].isel(time=window.records)
    return _series(times, fraction, "slipped_fraction", "slipped area fraction")


def slipped_steps(
    history: xr.Dataset, window: SlideWindow, tolerance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slipped fraction as it steps when nodes slip, land or lift off, also between two records.

    Times [s] and fractions [-], both (2 n,): each of n fractions at the times at which it begins and ends.
    """
    times, areas = history["time"].values[window.records], history["contact_area"].values
    touching = history["contact_state"].values[window.records] != OPEN
    gap, slip = history["gap"].values[window.records], accumulated_slip(history, window) - tolerance
    counted = touching & touching[0]
    slipped = counted & (slip > 0.0)
    rows, nodes = np.nonzero(np.diff(counted, axis=0) | np.diff(slipped, axis=0))
    moves = counted[rows, nodes] != counted[rows + 1, nodes]
    before, after = (np.where(moves, gap[at, nodes], slip[at, nodes]) for at in (rows, rows + 1))
    # A gap that does not change its sign says no more than the record.
    share = np.divide(before, before - after, out=np.ones_like(before), where=(before <= 0.0) != (after <= 0.0))
    moments, order = np.unique(times[rows] + share * (times[rows + 1] - times[rows]), return_inverse=True)

    def course(signal: NDArray[np.bool_], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        changes = np.diff(signal.astype(float), axis=0)[rows, nodes] * weights[nodes]
        first = np.atleast_1d(signal[0] @ weights)
        return np.cumsum(np.append(first, np.bincount(order, changes, moments.size)))

    fractions = np.full(moments.size + 1, np.nan)
    some = course(counted, np.ones_like(areas)) > 0.5
    np.divide(course(slipped, areas), course(counted, areas), out=fractions, where=some)
    return np.concatenate((times[:1], np.repeat(moments, 2), times[-1:])), np.repeat(fractions, 2)


def accumulated_slip(history: xr.Dataset, window: SlideWindow) -> NDArray[np.float64]:
    """Return the slip of every contact node since the slide began, shape (n_times, n_nodes) [m]."""
    slip: NDArray[np.float64] = history["slip_distance"].values[window.records].astype(float)
    since: NDArray[np.float64] = slip - slip[0]
    return since


def relative_displacement(history: xr.Dataset, window: SlideWindow) -> NDArray[np.float64]:
    """Return how far every contact node has moved relative to the plate since the slide began.

    Arrays: returns (n_times, n_nodes) [m].
    """
    counterface = history["contact_counterface"].values
    node = history["contact_displacement"].values[window.records]
    plate = history["counterface_displacement"].values[window.records][:, counterface]
    relative = (node - node[0]) - (plate - plate[0])
    _, tangential = split_along(relative, history["counterface_normal"].values[counterface])
    return np.asarray(np.linalg.norm(tangential, axis=-1), dtype=float)


def area_fraction(part: NDArray[np.bool_], whole: NDArray[np.bool_], areas: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the area of `part` over that of `whole` at each time, NaN where `whole` is empty.

    Arrays: part, whole (n_times, n_nodes); areas (n_nodes,) [m^2].
    """
    total = whole @ areas
    fraction = np.full(total.shape, np.nan)
    np.divide(part @ areas, total, out=fraction, where=total > 0.0)
    return fraction


def _series(times: xr.DataArray, values: NDArray[np.float64], name: str, meaning: str) -> xr.DataArray:
    import xarray as xr

    coordinates = {"time": times.values}
    return xr.DataArray(values, coordinates, ("time",), name, {"units": "1", "long_name": meaning})
