"""Marked and named events, and the time that is shown."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.colours import EVENT_COLOURS
from fingerslip.report.figures.marks import (
    event_keys,
    limit_to_slides,
    mark_events,
    mark_run,
    mark_slide,
    name_events,
    name_run,
    shown_until,
)
from fingerslip.report.figures.style import figure_grid
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS as EVENT_NAMES
from unit.report.figures.made import EVENTS, HISTORY, NO_SLIDE, marked


def test_time_shown_ends_after_the_last_overall_slip() -> None:
    window = SlideWindow(1.0, 3.0, 0, 10)
    assert shown_until([window], [SlipEvents(overall=1.8)]) == pytest.approx(1.8 + 0.35 * 0.8)
    assert shown_until([window, window], [SlipEvents(overall=1.8), None]) == 3.0
    assert shown_until([], []) is None


def test_events_that_happened_are_marked_in_their_colours() -> None:
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    mark_slide(axes, 1.0)
    mark_events(axes, SlipEvents(incipient=1.5, noticed=1.6, overall=1.7))
    assert marked(axes) == [1.0, 1.5, 1.7]
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
    assert list(event_keys(("incipient", "overall"))) == ["slide starts", "incipient", "overall"]


def test_a_run_is_named_like_it_is_marked() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    name_run([axes], HISTORY, EVENTS.slip)
    assert [text.get_text() for text in axes.texts] == ["slide starts", "incipient", "three-quarter", "overall"]
    _, (bare,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    name_run([bare], NO_SLIDE, None)
    assert not bare.texts
