"""Receptors around the two edges of the contact, and their signals.

Area A is the edge of the contact at the smaller tangential coordinate, area B the one at the larger. These names are
ours: the published figures only show the two edges.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN
from fingerslip.history import site_kinds, site_rows
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.windows import Floats, record_at, slide_tangent, slide_window

if TYPE_CHECKING:
    import xarray as xr

AREAS = ("A", "B")
Rows = NDArray[np.intp]


def contact_edges(history: xr.Dataset, time: float | None = None, counterface: int = 0) -> tuple[float, float] | None:
    """Return where the contact ends on both sides [m], at a time [s] or at the start of the slide."""
    row = history["contact_state"].values[_record(history, time)]
    touching = (row != OPEN) & (history["contact_counterface"].values == counterface)
    if not touching.any():
        return None
    along = history["contact_position"].values[touching] @ slide_tangent(history, counterface)
    return float(along.min()), float(along.max())


def receptors_in_areas(
    history: xr.Dataset, per_area: int = 5, kinds: Sequence[str] = RECEPTOR_KINDS, time: float | None = None
) -> Mapping[tuple[str, str], tuple[str, ...]]:
    """Choose the receptors around the two edges of the contact at a time [s]: the nearest `per_area` of each kind.

    Every receptor belongs to the nearer edge.
    """
    available = site_kinds(history)
    edges = contact_edges(history, time) if available.size else None
    if edges is None:
        return MappingProxyType({})
    names = history["site"].values
    along = np.asarray(history["site_position"].values @ slide_tangent(history), dtype=float)
    distance = np.abs(along[:, None] - np.asarray(edges))
    nearer = np.argmin(distance, axis=1)
    chosen = {}
    for kind, (index, area) in itertools.product(kinds, enumerate(AREAS)):
        members = np.flatnonzero((available == kind) & (nearer == index))
        order = members[np.argsort(distance[members, index], kind="stable")][:per_area]
        if order.size:
            chosen[kind, area] = tuple(str(name) for name in names[order])
    return MappingProxyType(chosen)


def receptor_signals(history: xr.Dataset, per_area: int = 5) -> xr.Dataset:
    """Average the signals of the receptors around each edge of the contact [m/s^2, J/m^3]."""
    import xarray as xr

    dims, times = ("kind", "area", "time"), history["time"].values
    shape = (len(RECEPTOR_KINDS), len(AREAS), times.size)
    acceleration, density, count = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape[:2], dtype=int)
    for (kind, area), names in receptors_in_areas(history, per_area).items():
        pair, rows = (RECEPTOR_KINDS.index(kind), AREAS.index(area)), site_rows(history, names)
        count[pair] = len(names)
        acceleration[pair] = tangential_acceleration(history, rows).mean(axis=1)
        if "strain_energy_density" in history:
            density[pair] = history["strain_energy_density"].values[:, rows].mean(axis=1)
    return xr.Dataset(
        {
            "acceleration": (dims, acceleration, {"units": "m/s^2", "long_name": "tangential acceleration"}),
            "strain_energy_density": (dims, density, {"units": "J/m^3", "long_name": "strain energy density"}),
        },
        {"kind": list(RECEPTOR_KINDS), "area": list(AREAS), "time": times, "receptor_count": (dims[:2], count)},
    )


def receptor_rows(history: xr.Dataset, kinds: Sequence[str], per_area: int, time: float | None = None) -> Rows:
    """Return the rows of the chosen receptors of some types, both areas together, at a time [s]; shape (n,)."""
    chosen = receptors_in_areas(history, per_area, kinds, time)
    return site_rows(history, [name for names in chosen.values() for name in names])


def tangential_acceleration(history: xr.Dataset, rows: Rows) -> Floats:
    """Return the acceleration (n_times, n_sites) of sites along the plate [m/s^2]: means over the step that ends there.

    After a jump of the plate's velocity the accelerations of an implicit scheme alternate from step to step, ten and
    more times as large as the change of velocity over a step; the mean of both ends of a step leaves that out. Of steps
    that control their own error it is the mean since the record before.
    """
    at_records = np.asarray(history["acceleration"].values[:, rows] @ slide_tangent(history), dtype=float)
    over_steps = at_records.copy()
    over_steps[1:] = 0.5 * (at_records[1:] + at_records[:-1])
    if history.attrs.get("time_step") == "auto":
        # There are steps between records; the change of velocity is the mean acceleration over all of them.
        velocity = np.asarray(history["velocity"].values[:, rows] @ slide_tangent(history), dtype=float)
        over_steps[1:] = np.diff(velocity, axis=0) / np.diff(history["time"].values)[:, None]
    return over_steps


def _record(history: xr.Dataset, time: float | None) -> int:
    if time is None:
        window = slide_window(history)
        return window.first if window else history.sizes["time"] - 1
    return max(record_at(history, time), 0)
