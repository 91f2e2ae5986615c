"""The axis of time: what is shown of it, lines at events, their names and keys."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from fingerslip.report.colours import EVENT_COLOURS
from fingerslip.report.figures.contact import energy_figure, force_figure, force_overview_figure, slip_maps_figure
from fingerslip.report.figures.marks import (
    event_keys,
    limit_to_slides,
    mark_events,
    mark_run,
    name_events,
    name_run,
    shown_time,
    shown_times,
    shown_until,
)
from fingerslip.report.figures.receptors import strain_energy_density_figure
from fingerslip.report.figures.style import figure_grid
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS as EVENT_NAMES
from unit.report.figures.made import EVENTS, HISTORY, NO_SLIDE, marked, panels
from unit.synthetic import PRESS_END


def test_time_shown_ends_after_the_last_overall_slip() -> None:
    window = SlideWindow(1.0, 3.0, 0, 10)
    assert shown_until([window], [SlipEvents(overall=1.8)]) == pytest.approx(1.8 + 0.35 * 0.8)
    assert shown_until([window, window], [SlipEvents(overall=1.8), None]) == 3.0
    assert shown_until([], []) is None


def test_events_that_happened_are_marked_in_their_colours() -> None:
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    mark_events(axes, SlipEvents(incipient=1.5, noticed=1.6, overall=1.7))
    assert marked(axes) == [1.5, 1.7]
    colours = {float(line.get_xdata()[0]): line.get_color() for line in axes.lines}
    assert (colours[1.5], colours[1.7]) == (EVENT_COLOURS["incipient"], EVENT_COLOURS["overall"])


def test_run_is_marked_at_its_slide_and_its_events() -> None:
    start = slide_window(HISTORY).start
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    mark_run(axes, HISTORY, None)
    assert marked(axes) == [start]
    mark_run(axes, HISTORY, SlipEvents(overall=start + 0.5))
    assert marked(axes) == [start, start, start + 0.5]


def test_time_shown_begins_a_share_before_the_slides() -> None:
    window = slide_window(HISTORY)
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    limit_to_slides(axes, {"run": HISTORY}, {}, before=0.3)
    assert axes.get_xlim() == pytest.approx((window.start - 0.3 * (window.end - window.start), window.end))
    limit_to_slides(axes, {"run": HISTORY}, {"run": Events(slip=SlipEvents(overall=window.start + 0.1))}, before=0.0)
    assert axes.get_xlim() == pytest.approx((window.start, window.start + 0.135))


def test_time_shown_reaches_beyond_events_of_another_reading() -> None:
    window = slide_window(HISTORY)
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    early = {"run": Events(slip=SlipEvents(overall=window.start + 0.1))}
    limit_to_slides(axes, {"run": HISTORY}, early, marked=[SlipEvents(incipient=window.start + 0.4)])
    assert axes.get_xlim()[1] == pytest.approx(window.start + 0.4 * 1.06)


def test_what_lies_beyond_a_panel_has_no_name() -> None:
    # A name far outside would leave the layout no room for the panels.
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    name_events(axes, 0.5, SlipEvents(incipient=1.0, overall=9.0))
    assert [text.get_text() for text in axes.texts] == ["slide starts", "incipient"]


def test_names_stand_beside_their_lines_and_apart_from_each_other() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    name_events(axes, 1.0, SlipEvents(incipient=1.49, three_quarter=1.495, overall=1.5))
    positions = {text.get_text(): text.get_position()[0] for text in axes.texts}
    assert list(positions) == ["slide starts", "incipient", "three-quarter", "overall"]
    assert positions["slide starts"] == pytest.approx(0.5)
    assert positions["incipient"] == pytest.approx(0.745)
    assert np.all(np.diff(list(positions.values())) >= 0.26 / 6.6 - 1e-9)


def test_nothing_is_named_where_nothing_happened() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    name_events(axes, None, None)
    name_events(axes, None, SlipEvents())
    assert not axes.texts


def test_every_event_has_a_name_a_colour_of_its_own_and_a_key() -> None:
    assert set(EVENT_NAMES) == set(EVENT_COLOURS)
    assert len(set(EVENT_COLOURS.values())) == 4
    assert list(event_keys([SlipEvents(overall=1.0), None, SlipEvents(incipient=1.0)])) == [
        "slide starts",
        "incipient",
        "overall",
    ]


def test_a_run_is_named_like_it_is_marked() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    name_run([axes], HISTORY, EVENTS.slip)
    assert [text.get_text() for text in axes.texts] == ["slide starts", "incipient", "three-quarter", "overall"]
    _, (bare,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    name_run([bare], NO_SLIDE, None)
    assert not bare.texts


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
