"""The slide that events are looked for in, and the time at which a signal crosses a level to stay there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.history import phase_times

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "EVENTS",
    "LATENCY",
    "MAIN_EVENTS",
    "NOTICED_NOTE",
    "READINGS",
    "READING_HEADINGS",
    "TIMES",
    "ContactForces",
    "SlideWindow",
    "contact_forces",
    "counterface_normal",
    "defines_time",
    "event_label",
    "slide_tangent",
    "slide_window",
    "split_along",
    "sustained_crossing",
    "sustained_crossings",
]


@dataclass(frozen=True)
class SlideWindow:
    """The records of one slide phase."""

    start: float  # time of the phase [s]
    end: float  # time of the phase [s]
    first: int  # first and last record of the slide, both included
    last: int  # first and last record of the slide, both included

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
    window = SlideWindow(start, end, max(_record_at(history, start), 0), _record_at(history, end))
    return window if window.last > window.first else None


def _record_at(history: xr.Dataset, moment: float) -> int:
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
        first, last = (_record_at(history, moment) for moment in (start, end))
        plates = history.variables.get("counterface_displacement")
        travel = np.zeros(0) if plates is None else np.ravel(plates.values[last] - plates.values[first])
        if slides and start == slides[-1][1] and travel @ before >= 0.0:
            slides[-1] = slides[-1][0], end
        else:
            slides.append((start, end))
        before = travel
    return slides


def sustained_crossing(
    times: NDArray[np.float64], values: NDArray[np.float64], level: float, sustained: float
) -> float | None:
    """Return when `values` first reach `level` and stay there.

    Arrays: times (n_times,) [s]; values (n_times,); sustained [s]; returns [s].

    Examples
    --------
    >>> import numpy as np
    >>> sustained_crossing(np.arange(6.0), np.array([0.0, 2.0, 0.0, 0.0, 2.0, 2.0]), 1.0, 0.9)
    3.5
    """
    return sustained_crossings(times, values[:, None], level, sustained)[0]


def sustained_crossings(
    times: NDArray[np.float64], values: NDArray[np.float64], level: float, sustained: float
) -> list[float | None]:
    """Return when each of several signals first reaches `level` and stays there; see :func:`sustained_crossing`.

    Arrays: times (n_times,) [s]; values (n_times, n); sustained [s]; returns [s].
    """
    above = np.zeros((values.shape[1], times.size + 2), dtype=np.int8)
    above[:, 1:-1] = (values >= level).T
    edges = np.diff(above, axis=1)
    # Times at which a signal is above: each begins and ends, signal by signal.
    (signals, starts), ends = np.nonzero(edges == 1), np.nonzero(edges == -1)[1] - 1
    lasts = (ends == times.size - 1) | (times[ends] - times[starts] >= sustained)
    crossed, first = np.unique(signals[lasts], return_index=True)
    crossings: list[float | None] = [None] * values.shape[1]
    for signal, start in zip(crossed.tolist(), starts[lasts][first].tolist(), strict=True):
        crossings[signal] = _crossing(times, values[:, signal], level, start)
    return crossings


def _crossing(times: NDArray[np.float64], values: NDArray[np.float64], level: float, index: int) -> float:
    if index == 0 or np.isnan(values[index - 1]):
        return float(times[index])
    share = (level - values[index - 1]) / (values[index] - values[index - 1])
    return float(times[index - 1] + share * (times[index] - times[index - 1]))


#: The slip events in order of time: name in files, and in words.
EVENTS: Mapping[str, str] = MappingProxyType(
    {"incipient": "incipient", "noticed": "48 %", "three_quarter": "three-quarter", "overall": "overall"}
)
#: What stands below tables that have the second of them.
NOTICED_NOTE = "48 %: the share of the contact that slips when people notice it (Barrea et al. 2018)."
#: The events that every reading gives; figures mark these.
MAIN_EVENTS = ("incipient", "three_quarter", "overall")
#: The time from incipient to overall slip.
LATENCY = "latency"
#: All times of a reading.
TIMES = (*EVENTS, LATENCY)

#: The readings: name in files, and in words.
READINGS: Mapping[str, str] = MappingProxyType(
    {"slip": "accumulated slip", "displacement": "displacement", "acceleration": "acceleration peaks"}
)
#: The readings where there is little room.
READING_HEADINGS: Mapping[str, str] = MappingProxyType(
    {"slip": "slip", "displacement": "displ.", "acceleration": "peaks"}
)


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


Floats = NDArray[np.float64]


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
        """Return tangential over normal force [-], shape (n_times,).

        Parameters
        ----------
        least : float, optional
            The ratio is missing (NaN) where the normal force is at or below this share of its largest value [-].
        """
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
    travel = np.asarray(history["counterface_displacement"].values[:, counterface], dtype=float)
    _, along = split_along(travel, normal)
    furthest = along[np.linalg.norm(along, axis=1).argmax()]
    direction = furthest if np.linalg.norm(furthest) > 0.0 else split_along(np.eye(3)[0], normal)[1]
    return np.asarray(direction / np.linalg.norm(direction))


def split_along(vectors: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Split vectors into their components along unit normals and what is left of them.

    Arrays: vectors (..., dim); normals (..., dim); returns (...,).

    Examples
    --------
    >>> import numpy as np
    >>> normal, tangential = split_along(np.array([[3.0, 4.0]]), np.array([0.0, 1.0]))
    >>> normal.tolist(), tangential.tolist()
    ([4.0], [[3.0, 0.0]])
    """
    along = np.asarray(np.einsum("...c,...c->...", vectors, normals), dtype=float)
    return along, vectors - along[..., None] * normals
