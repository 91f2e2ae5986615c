"""Which time a figure shows: that of the run, or since a hold began on a logarithmic axis where records are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fingerslip.history import phase_times

__all__ = ["ShownTime", "shown_time", "shown_times"]

# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    held: bool = False  # whether the time is counted from the start of a hold

    @property
    def label(self) -> str:
        """Label of the axis."""
        return "time since the hold began [s]" if self.held else "time [s]"

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    It is logarithmic where the time between records grows twentyfold and more and nothing slides then: from the start
    of the last hold, or of the run where there is none.
    """
    times, held = history["time"].values, _last_hold(history)
    since = times - (held or 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), logarithmic=True, held=held is not None)


def shown_times(histories: Sequence[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    shown = tuple(map(shown_time, histories))
    if all(one.logarithmic for one in shown) and len({one.held for one in shown}) == 1:
        return shown
    return tuple(ShownTime(history["time"].values) for history in histories)


def _last_hold(history: xr.Dataset) -> float | None:
    """Return when the last hold began [s], None where there is none or something slides after it."""
    holds, slides = phase_times(history, "hold"), phase_times(history, "slide")
    if not holds or any(end > holds[-1][0] for _, end in slides):
        return None
    return holds[-1][0]
