"""The look of all figures: grids of panels, marked and named events, the time shown."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.lines import Line2D

from fingerslip.report.figures.save import energy_figure
from fingerslip.report.figures.style import (
    EVENT_COLOURS,
    EVENT_NAMES,
    add_legend,
    columns_for,
    event_keys,
    figure_grid,
    limit_to_slides,
    mark_events,
    mark_run,
    mark_slide,
    name_events,
    shown_until,
    styled,
    titled,
)
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from unit.report.figures.made import HISTORY, marked, panels


def test_time_shown_ends_after_the_last_overall_slip() -> None:
    window = SlideWindow(1.0, 3.0, 0, 10)
    assert shown_until([window], [SlipEvents(overall=1.8)]) == pytest.approx(1.8 + 0.35 * 0.8)
    assert shown_until([window, window], [SlipEvents(overall=1.8), None]) == 3.0
    assert shown_until([], []) is None


def test_style_of_the_user_is_left_alone() -> None:
    with mpl.rc_context({"font.size": 33.0, "axes.grid": False}):
        figure = energy_figure(HISTORY)
        assert mpl.rcParams["font.size"] == 33.0
    assert panels(figure)[0].yaxis.label.get_fontsize() == 9.0


@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 3, 1), (3, 3, 1), (5, 3, 2), (4, 2, 2)])
def test_grid_has_as_many_panels_as_asked_for(count: int, columns: int, rows: int) -> None:
    figure, axes = figure_grid(count, columns, (3.0, 2.0), "a title", ("x [mm]", "y [mm]"))
    assert len(axes) == len(panels(figure)) == count
    assert axes[0].get_subplotspec().get_gridspec().nrows == rows
    assert figure.get_size_inches().tolist() == pytest.approx(
        [max(min(columns, count) * 3.0 + 0.6, 6.6), rows * 2 + 0.8]
    )
    assert (figure.get_suptitle(), figure.get_supylabel()) == ("a title", "y [mm]")
    # The lowest panel of every column says what is on its horizontal axis.
    assert sum(panel.get_xlabel() == "x [mm]" for panel in axes) == min(columns, count)
    assert axes[-1].get_xlabel() == "x [mm]"


@pytest.mark.parametrize(("share", "x", "y"), [("all", True, True), ("x", True, False), ("none", False, False)])
def test_panels_share_what_they_are_asked_to(share: str, x: bool, y: bool) -> None:
    _, (first, second) = figure_grid(2, 1, (3.0, 2.0), "", ("", ""), share=share)
    first.set_xlim(0.0, 7.0)
    first.set_ylim(0.0, 9.0)
    assert (second.get_xlim() == (0.0, 7.0)) == x
    assert (second.get_ylim() == (0.0, 9.0)) == y


def test_columns_are_three_at_most_and_four_panels_stand_two_by_two() -> None:
    assert [columns_for(count) for count in (0, 1, 2, 3, 4, 5, 12)] == [1, 1, 2, 3, 2, 3, 3]


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


def test_names_stand_beside_their_lines_and_apart_from_each_other() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    name_events(axes, 1.0, SlipEvents(incipient=1.49, three_quarter=1.495, overall=1.5))
    places = {text.get_text(): text.get_position()[0] for text in axes.texts}
    assert list(places) == ["slide starts", "incipient", "three-quarter", "overall"]
    assert places["slide starts"] == pytest.approx(0.5)
    assert places["incipient"] == pytest.approx(0.745)
    assert np.all(np.diff(list(places.values())) >= 0.26 / 6.6 - 1e-9)


def test_nothing_is_named_where_nothing_happened() -> None:
    _, (axes,) = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    name_events(axes, None, None)
    name_events(axes, None, SlipEvents())
    assert not axes.texts


def test_every_event_has_a_name_a_colour_of_its_own_and_a_key() -> None:
    assert set(EVENT_NAMES) == set(EVENT_COLOURS) == {"incipient", "noticed", "three_quarter", "overall"}
    assert len(set(EVENT_COLOURS.values())) == 4
    assert list(event_keys(("incipient", "overall"))) == ["slide starts", "incipient", "overall"]


@pytest.mark.parametrize(("names", "columns"), [(["a", "b"], 2), (["a rather long name of a key"] * 8, 3)])
def test_legend_takes_as_many_columns_as_the_figure_is_wide(names: list[str], columns: int) -> None:
    figure, _ = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    keys = {f"{name}{place}": Line2D([], []) for place, name in enumerate(names)}
    add_legend(figure, keys)
    (legend,) = figure.legends
    assert legend._ncols == columns
    assert [text.get_text() for text in legend.get_texts()] == list(keys)


def test_drawing_takes_the_style_also_where_it_fails() -> None:
    @styled
    def fail() -> None:
        assert mpl.rcParams["font.size"] == 9.0
        raise ZeroDivisionError

    with mpl.rc_context({"font.size": 33.0}):
        with pytest.raises(ZeroDivisionError):
            fail()
        assert mpl.rcParams["font.size"] == 33.0


def test_titles_say_what_tells_them_apart() -> None:
    assert (titled("Forces", "run 1"), titled("Forces", "")) == ("Forces: run 1", "Forces")
