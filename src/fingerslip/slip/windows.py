"""The slide that events are looked for in, and the time at which a signal crosses a level to stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.history import phase_times

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SlideWindow", "slide_window", "sustained_crossing", "sustained_crossings"]


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
    found: list[float | None] = [None] * values.shape[1]
    for signal, start in zip(crossed.tolist(), starts[lasts][first].tolist(), strict=True):
        found[signal] = _crossing(times, values[:, signal], level, start)
    return found


def _crossing(times: NDArray[np.float64], values: NDArray[np.float64], level: float, index: int) -> float:
    if index == 0 or np.isnan(values[index - 1]):
        return float(times[index])
    share = (level - values[index - 1]) / (values[index] - values[index - 1])
    return float(times[index - 1] + share * (times[index] - times[index - 1]))
