"""Receptors around the two edges of the contact, their signals, and acceleration peaks ranked by prominence over noise.

Area A is the edge of the contact at the smaller tangential coordinate, area B the one at the larger. These names are
ours: the published figures only show the two edges.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN
from fingerslip.history import site_kinds, site_rows, sites_of_kinds
from fingerslip.libraries import xr
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.settings import PeakSettings
from fingerslip.slip.windows import SlideWindow, record_at, slide_tangent, slide_window

AREAS = ("A", "B")
Rows = NDArray[np.intp]


def contact_edges(history: xr.Dataset, time: float | None = None, counterface: int = 0) -> tuple[float, float] | None:
    """Return where the contact ends on both sides [m], at a time [s] or at the start of the slide."""
    if time is None:
        window = slide_window(history)
        record = window.first if window else history.sizes["time"] - 1
    else:
        record = max(record_at(history, time), 0)
    touching = (history["contact_state"].values[record] != OPEN) & (
        history["contact_counterface"].values == counterface
    )
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


def receptor_signals(history: xr.Dataset) -> xr.Dataset:
    """Average the signals of five receptors of each type around each edge of the contact [m/s^2, J/m^3]."""
    dims, times = ("kind", "area", "time"), history["time"].values
    shape = (len(RECEPTOR_KINDS), len(AREAS), times.size)
    acceleration, density, count = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape[:2], dtype=int)
    for (kind, area), names in receptors_in_areas(history).items():
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


# Turns the median absolute deviation of normally distributed noise into its standard deviation.
_MAD_TO_DEVIATION = 1.4826
# The jump of the plate's velocity shows in the first steps, at once at every receptor near the plate [s].
_FIRST_PEAK_WITHIN = 0.05


@dataclass(frozen=True)
class Peak:
    """One acceleration peak."""

    time: float  # time of the peak [s]
    height: float  # largest tangential acceleration over the receptors, as mean over a time step [m/s^2]
    prominence: float  # height above the higher of the two valleys beside it [m/s^2]


@dataclass(frozen=True)
class PeakTable:
    """The acceleration peaks of a slide."""

    peaks: tuple[Peak, ...] = ()  # every peak that stands out of the noise, in order of time
    noise_floor: float = 0.0  # median of the signal between the transition and the largest peak [m/s^2]
    noise_spread: float = 0.0  # its scaled median absolute deviation [m/s^2]
    threshold: float = 0.0  # prominence, and height over the floor, that a peak needed [m/s^2]
    transition: Peak | None = None  # the peak of the press-to-slide change
    transition_end: float | None = None  # when the transient of that change was over [s]

    @property
    def largest(self) -> Peak | None:
        """The most prominent peak."""
        return max(self.peaks, key=lambda peak: peak.prominence, default=None)

    @property
    def by_prominence(self) -> tuple[Peak, ...]:
        """The peaks from the most prominent one on."""
        return tuple(sorted(self.peaks, key=lambda peak: -peak.prominence))


def acceleration_peaks(history: xr.Dataset, settings: PeakSettings | None = None, slide: int = 0) -> PeakTable:
    """Find the acceleration peaks of a slide.

    The signal is the largest tangential acceleration (absolute value) over the receptors around the two
    edges of the contact.

    Parameters
    ----------
    history : xarray.Dataset
        A two-dimensional history.
    settings : PeakSettings, optional
        How peaks are distinguished from noise.
    slide : int, optional
        Which of the slides, from 0.

    Returns
    -------
    PeakTable
        Without peaks where there is no slide, no such receptor, or no end of the transition.
    """
    settings = settings or PeakSettings()
    signal = peak_signal(history, settings, slide)
    return PeakTable() if signal is None else _tabulate(*_even(signal["time"].values, signal.values), settings)


def peak_signal(history: xr.Dataset, settings: PeakSettings, slide: int = 0) -> xr.DataArray | None:
    """Return the signal that peaks are looked for in [m/s^2]; None without a slide or such a receptor."""
    window = slide_window(history, slide)
    rows = slide_receptors(history, window, settings) if window else np.empty(0, dtype=np.intp)
    if window is None or rows.size == 0:
        return None
    values = np.abs(tangential_acceleration(history, rows)).max(axis=1)[window.records]
    times = {"time": history["time"].values[window.records]}
    meaning = {"units": "m/s^2", "long_name": "largest tangential acceleration"}
    return xr.DataArray(values, times, ("time",), "peak_signal", meaning)


def has_receptors(history: xr.Dataset, settings: PeakSettings) -> bool:
    """Tell whether the acceleration of the named sites, or else of any site of these kinds, is recorded."""
    if "acceleration" not in history:
        return False
    if settings.sites:
        return set(history["site"].values.tolist()).issuperset(settings.sites)
    return sites_of_kinds(history, settings.kinds).size > 0


def slide_receptors(history: xr.Dataset, window: SlideWindow, settings: PeakSettings) -> Rows:
    """Return the rows of the sites whose acceleration is read in a slide, shape (n_sites,)."""
    if not has_receptors(history, settings):
        return np.empty(0, dtype=np.intp)
    if settings.sites:
        return site_rows(history, settings.sites)
    return receptor_rows(history, settings.kinds, settings.per_area, float(history["time"].values[window.first]))


def followed_share(history: xr.Dataset, window: SlideWindow, rows: Rows, time: float) -> float:
    """Return the mean displacement of sites over that of the plate, from a time [s] to the end of the slide [-]."""
    tangent, ends = slide_tangent(history), np.array([np.searchsorted(history["time"].values, time), window.last])
    plate = history["counterface_displacement"].values[ends, 0] @ tangent
    skin = history["displacement"].values[ends][:, rows] @ tangent
    travel = float(plate[1] - plate[0])
    return float((skin[1] - skin[0]).mean()) / travel if travel else 1.0


def noise_of(signal: Floats) -> tuple[float, float]:
    """Return the noise floor (median) and spread (scaled median absolute deviation) of a signal (n,), in its unit."""
    floor = float(np.median(signal))
    return floor, _MAD_TO_DEVIATION * float(np.median(np.abs(signal - floor)))


def transition_end(times: Floats, signal: Floats, settings: PeakSettings) -> tuple[int, int] | None:
    """Find the records at which the press-to-slide transient of a signal (n_times,) [m/s^2] ends, roughly and exactly.

    Roughly, it is over where the signal stays below `transient` of its first peak for the time `quiet`. The noise is
    taken between there and the largest value after it. Exactly, the transient is over where the signal stays within
    that noise (floor and `over_noise` spreads), or below `over_largest` of that value, for the time `quiet`.
    """
    width = _records(times, settings.quiet)
    top = int(np.argmax(signal[: _records(times, _FIRST_PEAK_WITHIN) + 1]))
    rough = _first_quiet(signal, top, settings.transient * float(signal[top]), width)
    if rough is None:
        return None
    largest = rough + int(np.argmax(signal[rough:]))
    floor, spread = noise_of(signal[rough : max(largest, rough + 1)])
    level = max(floor + settings.over_noise * spread, settings.over_largest * float(signal[largest]))
    exact = _first_quiet(signal[:largest], rough, level, width)
    return rough, largest if exact is None else exact


def _first_quiet(signal: Floats, start: int, level: float, width: int) -> int | None:
    """Find the first record from `start` on from which `signal` stays at or below `level` for `width` records."""
    starts = range(start, signal.size - width + 1)
    return next((first for first in starts if signal[first : first + width].max() <= level), None)


def _tabulate(times: Floats, signal: Floats, settings: PeakSettings) -> PeakTable:
    ends = transition_end(times, signal, settings)
    if ends is None:
        return PeakTable()
    rough, quiet = ends
    top = int(np.argmax(signal[: rough + 1]))
    transition = Peak(float(times[top]), float(signal[top]), float(signal[top]))
    rows, prominences = _rising_peaks(signal, rough, _records(times, settings.separation))
    if rows.size == 0:
        floor, spread = noise_of(signal[rough:])
        return PeakTable((), floor, spread, 0.0, transition, float(times[quiet]))
    largest = int(rows[np.argmax(prominences)])
    floor, spread = noise_of(signal[min(quiet, largest - 1) : largest])
    threshold = max(settings.over_noise * spread, settings.over_largest * float(prominences.max()))
    clear = (rows >= quiet) & (prominences > threshold) & (signal[rows] > floor + threshold)
    peaks = tuple(
        Peak(float(times[index]), float(signal[index]), float(prominence))
        for index, prominence in zip(rows[clear], prominences[clear], strict=True)
    )
    return PeakTable(peaks, floor, spread, threshold, transition, float(times[quiet]))


def _rising_peaks(signal: Floats, start: int, distance: int) -> tuple[Rows, Floats]:
    """Return the peaks from `start` on and their prominences, without the ringing after a release.

    Ringing only falls; a release exceeds what was just before it. Two distances back there was at least one swing.
    """
    # scipy.signal is slow to import, and study files are read without it.
    from scipy.signal import find_peaks

    rows, properties = find_peaks(signal[start:], distance=distance, prominence=0.0)
    rows = rows + start
    rising = np.array([signal[max(i - 2 * distance, 0) : i].max() <= signal[i] for i in rows], dtype=bool)
    return rows[rising], properties["prominences"][rising]


def _even(times: Floats, signal: Floats) -> tuple[Floats, Floats]:
    """Return a signal at even times: interpolated where a knot within the slide has changed the time between records.

    Examples
    --------
    >>> _even(np.array([0.0, 2.0, 4.0, 5.0]), np.array([0.0, 4.0, 8.0, 0.0]))[1].tolist()
    [0.0, 2.0, 4.0, 6.0, 8.0, 0.0]
    """
    steps = np.diff(times)
    if np.ptp(steps) <= 1e-6 * steps.max():
        return times, signal
    even = np.linspace(times[0], times[-1], round((times[-1] - times[0]) / steps.min()) + 1)
    return even, np.interp(even, times, signal)


def _records(times: Floats, duration: float) -> int:
    """Return how many steps a duration takes, at least one."""
    return max(round(duration / float(np.median(np.diff(times)))), 1)
