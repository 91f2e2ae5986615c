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

__all__ = ["SlideWindow", "slide_window", "sustained_crossing"]


@dataclass(frozen=True)
class SlideWindow:
    """The records of one slide phase.

    Parameters
    ----------
    start, end : float
        Time of the phase [s].
    first, last : int
        First and last record of the slide, both included; the first is the last record at or before
        `start`, which is the state that slip is measured from.
    """

    start: float
    end: float
    first: int
    last: int

    @property
    def records(self) -> slice:
        """The slice of the time axis."""
        return slice(self.first, self.last + 1)


def slide_window(history: xr.Dataset, slide: int = 0) -> SlideWindow | None:
    """Find the records of a slide phase.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    slide : int, optional
        Which of the slide phases, from 0.

    Returns
    -------
    SlideWindow or None
        None where the programme has no slide, or none that was recorded.

    Raises
    ------
    InputError
        Where there are slides, but not that one.
    """
    slides = phase_times(history, "slide")
    if not slides and slide == 0:
        return None
    if not 0 <= slide < len(slides):
        raise InputError("slide", f"got {slide}", f"the programme has {len(slides)} slide phase(s), counted from 0")
    start, end = slides[slide]
    times = history["time"].values
    # Sums of phase lengths and multiples of the step differ in the last digits.
    slack = 1e-6 * float(np.diff(times).min()) if times.size > 1 else 0.0
    first, last = (int(np.searchsorted(times, moment + slack, side="right")) - 1 for moment in (start, end))
    window = SlideWindow(start, end, max(first, 0), last)
    return window if window.last > window.first else None


def sustained_crossing(
    times: NDArray[np.float64], values: NDArray[np.float64], level: float, sustained: float
) -> float | None:
    """Return when `values` first reach `level` and stay there.

    Parameters
    ----------
    times : (n_times,) array
        Times [s], rising.
    values : (n_times,) array
        The signal; NaN counts as below the level.
    level : float
        The level, in the signal's unit.
    sustained : float
        How long the signal must stay at or above the level [s]; staying there up to the last time
        is enough.

    Returns
    -------
    float or None
        The time of the crossing, interpolated linearly between two records [s].

    Examples
    --------
    >>> import numpy as np
    >>> sustained_crossing(np.arange(6.0), np.array([0.0, 2.0, 0.0, 0.0, 2.0, 2.0]), 1.0, 0.9)
    3.5
    """
    above = np.concatenate(([False], values >= level, [False]))
    edges = np.diff(above.astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    for start, end in zip(starts, ends, strict=True):
        if end == times.size - 1 or times[end] - times[start] >= sustained:
            return _crossing(times, values, level, int(start))
    return None


def _crossing(times: NDArray[np.float64], values: NDArray[np.float64], level: float, index: int) -> float:
    if index == 0 or np.isnan(values[index - 1]):
        return float(times[index])
    share = (level - values[index - 1]) / (values[index] - values[index - 1])
    return float(times[index - 1] + share * (times[index] - times[index - 1]))
