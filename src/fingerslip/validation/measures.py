"""The numbers that published values and statements are compared with, each read from one history."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from fingerslip import slip
from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN
from fingerslip.libraries import xr
from fingerslip.results import RunResult
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.receptors import receptor_rows, tangential_acceleration
from fingerslip.slip.windows import counterface_normal, slide_tangent

#: The reference nodes that the paper says are in contact, on the skin.
REFERENCE_NODES = tuple(f"skin-{line}{number}" for line in "hv" for number in (2, 3, 4, 5))
#: Distances from which a node may be said to have left the plate's line [m]; the middle one is in use.
NODE_TOLERANCES = (20e-6, 50e-6, 100e-6)
#: How the readings of a run in 3D are made, in words.
SOLID_READINGS: Mapping[str, str] = {
    "slip": "slip map: accumulated slip of a tenth and of all of the area",
    "displacement": "eight reference nodes leave the plate's line by 50 um",
    "acceleration": "acceleration peaks at the eight reference nodes",
}

# The release itself lasts a few steps and is no vibration after it [s].
_RELEASE = 0.02
# Vibrations are compared over the same time, whenever overall slip was [s].
_VIBRATION = 0.1


@dataclass(frozen=True)
class Densities:
    """Strain energy density at the receptors around the edges of the contact, by type and edge."""

    growth: Mapping[tuple[str, str], float]  # at overall slip over that at the start of the slide [-]
    range_after: Mapping[tuple[str, str], float]  # largest less smallest after overall slip, over the mean there [-]
    mean_after: Mapping[tuple[str, str], float]  # mean after overall slip [J/m^3]


@dataclass(frozen=True)
class Measures:
    """The numbers of one run."""

    run: RunResult  # the run with its events and values
    peaks: slip.PeakTable = field(default_factory=slip.PeakTable)
    largest_acceleration: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))  # [m/s^2]
    centre_after_edge: float | None = None  # [s]
    densities: Densities | None = None  # strain energy density
    rms_after: float | None = None  # [m/s^2]
    travel: float | None = None  # travel of the plate at overall slip over friction coefficient times indentation [-]
    node_tolerances: Mapping[float, slip.SlipEvents] = field(
        default_factory=lambda: MappingProxyType({})
    )  # by distance [m]

    @property
    def incipient_peak(self) -> slip.Peak | None:
        """The peak that is read as incipient slip."""
        return self._peak_at(self.run.events.acceleration.incipient)

    @property
    def overall_peak(self) -> slip.Peak | None:
        """The peak that is read as overall slip."""
        return self._peak_at(self.run.events.acceleration.overall)

    @property
    def middle_peaks(self) -> int:
        """How many peaks there are between those of incipient and overall slip."""
        first, last = self.incipient_peak, self.overall_peak
        if first is None or last is None:
            return 0
        return sum(first.time < peak.time < last.time for peak in self.peaks.peaks)

    def node_range(self, name: str) -> float | None:
        """Return how far a time of the nodes moves at most over the tolerances [s]; None where it is missing."""
        times = [events.time(name) for events in self.node_tolerances.values()]
        ours = self.run.events.displacement.time(name)
        times_known = [time for time in times if time is not None]
        if ours is None or not times_known or len(times_known) < len(times):
            return None
        return max(abs(time - ours) for time in times_known)

    def _peak_at(self, time: float | None) -> slip.Peak | None:
        return next((peak for peak in self.peaks.peaks if peak.time == time), None)


def measure(run: RunResult, history: xr.Dataset) -> Measures:
    """Read the numbers of a run in 2D with receptors and a slide."""
    settings, overall = slip.EventSettings(), run.events.slip.overall
    window = slip.slide_window(history)
    if window is None:
        return Measures(run)
    peaks = slip.acceleration_peaks(history, settings.peaks)
    return Measures(
        run=run,
        peaks=peaks,
        largest_acceleration=largest_accelerations(history, window, peaks.transition_end or window.start),
        centre_after_edge=centre_after_edge(history, window, settings),
        densities=None if overall is None else densities(history, window, overall),
        rms_after=None if overall is None else rms_after(history, window, overall + _RELEASE),
        travel=None if overall is None else travel_over_friction_depth(history, window, overall),
    )


def measure_3d(run: RunResult, history: xr.Dataset) -> Measures:
    """Read the numbers of a run in 3D, whose displacements and accelerations the paper reads at reference nodes."""
    readings = {
        tolerance: slip.reference_events(history, REFERENCE_NODES, slip.EventSettings(displacement_tolerance=tolerance))
        for tolerance in NODE_TOLERANCES
    }
    peaks = slip.acceleration_events(history, slip.PeakSettings(sites=REFERENCE_NODES))
    displacement = readings[slip.EventSettings().displacement_tolerance]
    events = dataclasses.replace(run.events, displacement=displacement, acceleration=peaks)
    return Measures(dataclasses.replace(run, events=events), node_tolerances=MappingProxyType(readings))


def largest_accelerations(history: xr.Dataset, window: slip.SlideWindow, start: float) -> Mapping[str, float]:
    """Return the largest tangential acceleration from `start` to the end of the slide, by receptor type [m/s^2]."""
    largest = {}
    for kind in RECEPTOR_KINDS:
        values = _accelerations(history, window, (kind,), start)
        if values.size:
            largest[kind] = float(np.abs(values).max())
    return MappingProxyType(largest)


def centre_after_edge(history: xr.Dataset, window: slip.SlideWindow, settings: slip.EventSettings) -> float | None:
    """Return how much later the inner quarter of the contact begins to lag the plate than the outer quarter.

    The nodes in contact at the start of the slide are ranked by their distance from the middle of the contact.
    Medians are taken; a node that never lags counts as lagging from the end of the slide on [s].
    """
    touching = np.flatnonzero(history["contact_state"].values[window.first] != OPEN)
    if touching.size < 4:
        return None
    times = history["time"].values[window.records]
    lags = slip.relative_displacement(history, window)[:, touching]
    first = slip.sustained_crossings(times, lags, settings.displacement_tolerance, settings.sustained)
    lagging = np.array([window.end if time is None else time for time in first])
    along = history["contact_position"].values[touching] @ slide_tangent(history)
    order = np.argsort(np.abs(along - 0.5 * (along.min() + along.max())))
    quarter = touching.size // 4
    return float(np.median(lagging[order[:quarter]]) - np.median(lagging[order[-quarter:]]))


def densities(history: xr.Dataset, window: slip.SlideWindow, overall: float) -> Densities:
    """Read the strain energy density around both edges of the contact, before and after overall slip [s]."""
    signals = slip.receptor_signals(history)
    density, count = signals["strain_energy_density"], signals["receptor_count"]
    times = signals["time"].values
    at_overall = min(int(np.searchsorted(times, overall)), window.last)
    growth, range_after, mean_after = {}, {}, {}
    for kind, area in ((str(k), str(a)) for k in signals["kind"].values for a in signals["area"].values):
        if not int(count.sel(kind=kind, area=area)):
            continue
        values = density.sel(kind=kind, area=area).values
        after = values[at_overall : window.last + 1]
        growth[kind, area] = float(values[at_overall] / values[window.first])
        range_after[kind, area] = float(np.ptp(after) / after.mean())
        mean_after[kind, area] = float(after.mean())
    return Densities(growth, range_after, mean_after)


def rms_after(history: xr.Dataset, window: slip.SlideWindow, start: float) -> float | None:
    """Return the root mean square acceleration of FA-I and SA-I in the 0.1 s after `start` [m/s^2]."""
    values = _accelerations(history, window, slip.EventSettings().peaks.kinds, start, start + _VIBRATION)
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def travel_over_friction_depth(history: xr.Dataset, window: slip.SlideWindow, time: float) -> float | None:
    """Return the travel of the plate from the start of the slide to `time` [s], over friction times indentation [-].

    The travel is positive whichever way the plate slides. Without friction or indentation there is none.
    """
    times = history["time"].values
    along = history["counterface_displacement"].values[:, 0] @ slide_tangent(history)
    normal = history["counterface_displacement"].values[window.first, 0] @ counterface_normal(history)
    travel = abs(float(np.interp(time, times, along) - np.interp(window.start, times, along)))
    scale = float(history["counterface_friction_coefficient"].values[0]) * float(normal)
    return travel / scale if scale else None


def _accelerations(
    history: xr.Dataset, window: slip.SlideWindow, kinds: tuple[str, ...], start: float, end: float = math.inf
) -> Floats:
    """Return the tangential acceleration of receptors from `start` to `end` of the slide, (n_times, n_sites)."""
    times = history["time"].values
    rows = receptor_rows(history, kinds, slip.EventSettings().peaks.per_area, float(times[window.first]))
    first, last = np.searchsorted(times, (start, end))
    return tangential_acceleration(history, rows)[first : min(int(last), window.last + 1)]
