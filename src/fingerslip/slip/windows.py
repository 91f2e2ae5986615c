"""The slide in a history: its window, contact forces, and the fraction that has slipped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerslip.arrays import Flags, Floats
from fingerslip.contact.states import OPEN, SLIP
from fingerslip.errors import InputError
from fingerslip.history import phase_times
from fingerslip.libraries import xr

# Travel along its surface from which on a counterface slides [m]; a press along a tilted normal leaves rounding.
_STILL = 1e-9


@dataclass(frozen=True)
class SlideWindow:
    """The records of one slide phase."""

    start: float  # of the phase [s]
    end: float  # of the phase [s]
    first: int  # record
    last: int  # record, included

    @property
    def records(self) -> slice:
        """The slice of the time axis."""
        return slice(self.first, self.last + 1)


def slide_window(history: xr.Dataset, slide: int = 0) -> SlideWindow | None:
    """Find the records of a slide. Slide phases that follow each other are one, up to where the plate turns back."""
    slides = _slides(history)
    if not slides and slide == 0:
        return None
    if not 0 <= slide < len(slides):
        allowed = f"the programme has {len(slides)} slide{'s' * (len(slides) != 1)}, counted from 0"
        raise InputError("slide", f"got {slide}", allowed)
    start, end = slides[slide]
    window = SlideWindow(start, end, max(record_at(history, start), 0), record_at(history, end))
    return window if window.last > window.first else None


def record_at(history: xr.Dataset, moment: float) -> int:
    """Return the last record at or before a time, -1 where there is none."""
    times = history.variables["time"].values
    # Sums of phase lengths and multiples of the step differ in the last digits.
    slack = 1e-6 * float(np.diff(times).min()) if times.size > 1 else 0.0
    return int(np.searchsorted(times, moment + slack, side="right")) - 1


def _slides(history: xr.Dataset) -> list[tuple[float, float]]:
    """Return start and end of every slide [s]: phases that follow each other are one, up to where one turns back."""
    slides: list[tuple[float, float]] = []
    before = np.zeros(0)
    for start, end in phase_times(history, "slide"):
        first, last = (record_at(history, moment) for moment in (start, end))
        plates = history.variables.get("counterface_displacement")
        travel = np.zeros(0) if plates is None else np.ravel(plates.values[last] - plates.values[first])
        if slides and start == slides[-1][1] and travel @ before >= 0.0:
            slides[-1] = slides[-1][0], end
        else:
            slides.append((start, end))
        before = travel
    return slides


def sustained_crossing(times: Floats, values: Floats, level: float, sustained: float) -> float | None:
    """Return when `values` (n_times,) first reach `level` and stay there for the time `sustained` [s].

    Examples
    --------
    >>> import numpy as np
    >>> sustained_crossing(np.arange(6.0), np.array([0.0, 2.0, 0.0, 0.0, 2.0, 2.0]), 1.0, 0.9)
    3.5
    """
    return sustained_crossings(times, values[:, None], level, sustained)[0]


def sustained_crossings(times: Floats, values: Floats, level: float, sustained: float) -> list[float | None]:
    """Return when each of several signals (n_times, n) does what :func:`sustained_crossing` says [s]."""
    above = np.zeros((values.shape[1], times.size + 2), dtype=np.int8)
    above[:, 1:-1] = (values >= level).T
    edges = np.diff(above, axis=1)
    # Times at which a signal is above: each begins and ends, signal by signal.
    (signals, starts), ends = np.nonzero(edges == 1), np.nonzero(edges == -1)[1] - 1
    lasts = (ends == times.size - 1) | (times[ends] - times[starts] >= sustained)
    crossed, first = np.unique(signals[lasts], return_index=True)
    crossings: list[float | None] = [None] * values.shape[1]
    for signal, start in zip(crossed.tolist(), starts[lasts][first].tolist(), strict=True):
        crossings[signal] = float(times[start])
        if start and not np.isnan(before := values[start - 1, signal]):
            share = (level - before) / (values[start, signal] - before)
            crossings[signal] = float(times[start - 1] + share * (times[start] - times[start - 1]))
    return crossings


#: The slip events in order of time: name in files, and in words.
EVENTS: Mapping[str, str] = {
    "incipient": "incipient",
    "noticed": "48 %",
    "three_quarter": "three-quarter",
    "overall": "overall",
}
#: What stands below tables that have the second of them.
NOTICED_NOTE = (
    "48 % is when 48 % of the contact has slipped; files call it noticed, as people notice when about as much is"
    " slipping (Barrea et al. 2018)."
)
#: The events that every reading gives; figures mark these.
MAIN_EVENTS = ("incipient", "three_quarter", "overall")
#: The time from incipient to overall slip.
LATENCY = "latency"
#: All times of a reading.
TIMES = (*EVENTS, LATENCY)

#: The readings: name in files, and in words.
READINGS: Mapping[str, str] = {
    "slip": "accumulated slip",
    "displacement": "displacement",
    "acceleration": "acceleration peaks",
}
#: The readings where there is little room.
READING_HEADINGS: Mapping[str, str] = {"slip": "slip", "displacement": "displ.", "acceleration": "peaks"}


def event_label(time: str) -> str:
    """Return the name of a slip event, or of the latency, in words.

    Examples
    --------
    >>> event_label("three_quarter"), event_label("latency")
    ('three-quarter slip', 'latency')
    """
    return LATENCY if time == LATENCY else f"{EVENTS[time]} slip"


def defines_time(reading: str, time: str) -> bool:
    """Tell whether a reading defines a time: no acceleration peak belongs to 48 % slip."""
    return (reading, time) != ("acceleration", "noticed")


@dataclass(frozen=True)
class ContactForces:
    """The force of a counterface on the body over time, split along the counterface's normal."""

    normal: Floats  # (n_times,), normal force, positive in compression [N]
    tangential: Floats  # (n_times, dim), tangential force, a vector in the surface of the counterface [N]

    @property
    def friction(self) -> Floats:
        """Magnitude of the tangential force [N], shape (n_times,)."""
        return np.asarray(np.linalg.norm(self.tangential, axis=1), dtype=float)

    def ratio(self, least: float = 1e-9) -> Floats:
        """Return tangential over normal force (n_times,) [-]: NaN where that is a `least` share of its largest."""
        ratio = np.full(self.normal.shape, np.nan)
        np.divide(self.friction, self.normal, out=ratio, where=self.normal > least * self.normal.max(initial=0.0))
        return ratio


def contact_forces(history: xr.Dataset, counterface: int = 0) -> ContactForces:
    """Return the force of a counterface on the body over time, split into its normal and tangential parts."""
    force = np.asarray(history.variables["counterface_force"].values[:, counterface], dtype=float)
    return ContactForces(*split_along(force, counterface_normal(history, counterface)))


def counterface_normal(history: xr.Dataset, counterface: int = 0) -> Floats:
    """Return the outward unit normal of a counterface, shape (dim,)."""
    return np.asarray(history.variables["counterface_normal"].values[counterface], dtype=float)


def slide_tangent(history: xr.Dataset, counterface: int = 0) -> Floats:
    """Return the unit tangent of a counterface along its slide, shape (dim,).

    In 2D it is the normal turned clockwise: (1, 0) for a plate below. In 3D it is the direction in which the
    counterface travels furthest along its surface, and x where it does not travel.
    """
    normal = counterface_normal(history, counterface)
    if normal.size == 2:
        return np.array([normal[1], -normal[0]])
    direction = travel_direction(history, counterface)
    if not direction.any():
        direction = split_along(np.eye(3)[0], normal)[1]
        direction /= np.linalg.norm(direction)
    return direction


def travel_direction(history: xr.Dataset, counterface: int = 0) -> Floats:
    """Return the unit direction (dim,) in which a counterface travels furthest along its surface; zeros at rest."""
    travel = np.asarray(history["counterface_displacement"].values[:, counterface], dtype=float)
    _, along = split_along(travel, counterface_normal(history, counterface))
    furthest = along[np.linalg.norm(along, axis=1).argmax()]
    length = np.linalg.norm(furthest)
    return np.asarray(furthest / length if length > _STILL else np.zeros_like(furthest))


def split_along(vectors: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Split vectors (..., dim) into their components (...) along unit normals (..., dim), and what is left of them.

    Examples
    --------
    >>> import numpy as np
    >>> normal, tangential = split_along(np.array([[3.0, 4.0]]), np.array([0.0, 1.0]))
    >>> normal.tolist(), tangential.tolist()
    ([4.0], [[3.0, 0.0]])
    """
    along = np.asarray(np.einsum("...c,...c->...", vectors, normals), dtype=float)
    return along, vectors - along[..., None] * normals


def contact_area(history: xr.Dataset) -> xr.DataArray:
    """Return the area in contact over time, shape (n_times,): tributary areas of all nodes that are not open [m^2]."""
    area = (history["contact_state"].values != OPEN) @ history["contact_area"].values
    return _series(history["time"], area, "contact_area", "area in contact").assign_attrs(units="m^2")


def slipping_fraction(history: xr.Dataset) -> xr.DataArray:
    """Return the area fraction of the contact that slips at each time [-]."""
    state = history["contact_state"].values
    fraction = area_fraction(state == SLIP, state != OPEN, history["contact_area"].values)
    return _series(history["time"], fraction, "slipping_fraction", "slipping area fraction")


def stick_ratio(history: xr.Dataset) -> xr.DataArray:
    """Return the stick ratio, shape (n_times,): sticking over contact area [-], missing while nothing touches."""
    return (1.0 - slipping_fraction(history)).rename("stick_ratio").assign_attrs(units="1", long_name="stick ratio")


def slipped_fraction(history: xr.Dataset, window: SlideWindow, tolerance: float) -> xr.DataArray:
    """Return the area fraction that has slipped by more than a tolerance [m] since the slide began [-].

    Only nodes that were in contact when the slide began, and still are, are weighed: skin that rolls
    onto the plate during the slide is new there and could not slip yet.
    """
    touching = history["contact_state"].values[window.records] != OPEN
    counted = touching & touching[0]
    slipped = accumulated_slip(history, window) > tolerance
    fraction = area_fraction(slipped & counted, counted, history["contact_area"].values)
    times = history["time"].isel(time=window.records)
    return _series(times, fraction, "slipped_fraction", "slipped area fraction")


def slipped_steps(history: xr.Dataset, window: SlideWindow, tolerance: float) -> tuple[Floats, Floats]:
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

    def totals(signal: Flags, weights: Floats) -> Floats:
        changes = np.diff(signal.astype(float), axis=0)[rows, nodes] * weights[nodes]
        first = np.atleast_1d(signal[0] @ weights)
        return np.cumsum(np.append(first, np.bincount(order, changes, moments.size)))

    fractions = np.full(moments.size + 1, np.nan)
    some = totals(counted, np.ones_like(areas)) > 0.5
    np.divide(totals(slipped, areas), totals(counted, areas), out=fractions, where=some)
    return np.concatenate((times[:1], np.repeat(moments, 2), times[-1:])), np.repeat(fractions, 2)


def accumulated_slip(history: xr.Dataset, window: SlideWindow) -> Floats:
    """Return the slip of every contact node since the slide began, shape (n_times, n_nodes) [m]."""
    slip: Floats = history["slip_distance"].values[window.records].astype(float)
    return np.asarray(slip - slip[0])


def relative_displacement(history: xr.Dataset, window: SlideWindow) -> Floats:
    """Return how far contact nodes have moved relative to the plate since the slide began, (n_times, n_nodes) [m]."""
    return lags(history, window, history["contact_displacement"].values, history["contact_counterface"].values)


def lags(history: xr.Dataset, window: SlideWindow, moved: Floats, counterface: ArrayLike) -> Floats:
    """Return how far points lag their counterfaces along the surface since the slide began, (n_times, n) [m].

    `moved` (n_records, n, dim) are their displacements in the whole history [m]; all may have one counterface.
    """
    numbers, points = np.asarray(counterface), moved[window.records]
    plates = history["counterface_displacement"].values[window.records][:, numbers]
    relative = (points - points[0]) - (plates - plates[0])
    _, tangential = split_along(relative, history["counterface_normal"].values[numbers])
    return np.asarray(np.linalg.norm(tangential, axis=-1), dtype=float)


def area_fraction(part: Flags, whole: Flags, areas: Floats) -> Floats:
    """Return the area of `part` (n_times, n_nodes) over that of `whole` at each time, NaN where `whole` is empty."""
    total = whole @ areas
    fraction = np.full(total.shape, np.nan)
    np.divide(part @ areas, total, out=fraction, where=total > 0.0)
    return fraction


def _series(times: xr.DataArray, values: Floats, name: str, meaning: str) -> xr.DataArray:
    coordinates = {"time": times.values}
    return xr.DataArray(values, coordinates, ("time",), name, {"units": "1", "long_name": meaning})
