"""Which time figures show: linear, or logarithmic where records are."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from fingerslip.report.figures.contact import energy_figure, force_figure, force_overview_figure, slip_maps_figure
from fingerslip.report.figures.marks import shown_time, shown_times
from fingerslip.report.figures.receptors import strain_energy_density_figure
from unit.report.figures.made import HISTORY, panels
from unit.synthetic import PRESS_END


def growing(history: xr.Dataset, kinds: tuple[str, str] = ("press", "hold")) -> xr.Dataset:
    """Return a history whose second phase is of another kind and whose records grow apart in it."""
    times = history["time"].values
    later = times > PRESS_END
    since = np.geomspace(0.01, 100.0, int(later.sum()))
    held = history.assign_coords(time=np.concatenate([times[~later], PRESS_END + since]))
    return held.assign(phase_kind=("phase", list(kinds)), phase_end=("phase", [PRESS_END, PRESS_END + 100.0]))


def test_even_records_are_shown_over_the_time_of_the_run() -> None:
    shown = shown_time(HISTORY)
    assert (shown.logarithmic, shown.label) == (False, "time [s]")
    np.testing.assert_array_equal(shown.values, HISTORY["time"].values)


def test_records_that_grow_apart_are_shown_since_the_hold_began() -> None:
    history = growing(HISTORY)
    shown = shown_time(history)
    assert (shown.logarithmic, shown.label) == (True, "time since the hold began [s]")
    later = history["time"].values > PRESS_END
    assert np.isnan(shown.values[~later]).all()
    assert np.nanmin(shown.values) == pytest.approx(0.01)
    assert np.nanmax(shown.values) == pytest.approx(100.0)


def test_without_a_hold_the_time_is_that_of_the_run() -> None:
    history = growing(HISTORY, ("press", "press")).isel(time=slice(int(PRESS_END / 5e-3), None))
    history = history.assign_coords(time=history["time"].values - PRESS_END)
    shown = shown_time(history)
    assert (shown.logarithmic, shown.label) == (True, "time [s]")
    assert np.isnan(shown.values[0])


def test_runs_that_share_an_axis_are_logarithmic_together() -> None:
    held = growing(HISTORY)
    assert [one.logarithmic for one in shown_times((held, held))] == [True, True]
    assert [one.logarithmic for one in shown_times((held, HISTORY))] == [False, False]


@pytest.mark.parametrize(
    "draw",
    [
        force_figure,
        energy_figure,
        strain_energy_density_figure,
        lambda history: force_overview_figure({"held": history}, {}),
        lambda history: slip_maps_figure({"held": history}, {}),
    ],
)
def test_figures_over_time_take_the_axis(draw: object) -> None:
    figure = draw(growing(HISTORY))  # type: ignore[operator]
    assert isinstance(figure, Figure)
    figure.canvas.draw()
    lowest = panels(figure)[-1]
    assert lowest.get_xscale() == "log"
    assert lowest.get_xlabel() == "time since the hold began [s]"
    assert lowest.get_xlim() == pytest.approx((0.01, 100.0), rel=0.1)
