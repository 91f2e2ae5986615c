"""The look of all figures: grids, titles, legends, files; the axis of time and what is marked on it."""

import struct

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.errors import InputError, ResultError
from fingerslip.report.colours import EVENT_COLOURS
from fingerslip.report.figures import signals, style, time_axis
from fingerslip.report.page import pictures
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS as EVENT_NAMES
from unit.report.figures.made import EVENTS, HISTORY, NO_SLIDE, marked, panels, texts
from unit.synthetic import PRESS_END

WINDOW = slide_window(HISTORY)


def single_panel(width=6.0, title="", labels=("", "")):
    figure, (axes,) = style.figure_grid(1, 1, (width, 2.0), title, labels)
    return figure, axes


def test_style_of_the_user_is_left_alone_also_where_drawing_fails():
    @style.with_style
    def fail():
        assert mpl.rcParams["font.size"] == 9.0
        raise ZeroDivisionError

    with mpl.rc_context({"font.size": 33.0, "axes.grid": False}):
        figure = signals.energy_figure(HISTORY)
        with pytest.raises(ZeroDivisionError):
            fail()
        assert mpl.rcParams["font.size"] == 33.0
    assert panels(figure)[0].yaxis.label.get_fontsize() == 9.0


def test_panels_have_letters_where_the_look_has_them_and_there_are_several():
    for look, count, expected in (("paper", 3, ["a", "b", "c"]), ("paper", 1, []), ("page", 3, [])):
        with style.looking(look):
            _, axes = style.figure_grid(count, count, (3.0, 2.0), "", ("", ""))
        assert [text for panel in axes for text in texts(panel)] == expected
    with style.looking("paper"):
        wide, narrow = (style.figure_grid(2, 1, (3.0, 2.0), "", ("", ""), full=full)[0] for full in (True, False))
    assert (wide.get_figwidth(), narrow.get_figwidth()) == (7.2, 3.5)


def test_titles_are_wrapped_and_their_dollars_are_no_mathematics():
    title = "Forces and slipping area: " + ", ".join(["friction coefficient 0.6"] * 6)
    figure, _ = single_panel(title=title)
    assert figure.get_suptitle().replace("\n", " ") == title
    figure.draw_without_rendering()
    assert figure._suptitle.get_window_extent().x1 <= figure.bbox.x1
    names = ["cheap $\\frac{$", "dear $x_{$"]

    @style.with_style
    def draw():
        figure, axes = style.figure_grid(2, 2, (2.0, 2.0), names[0], (names[0], names[1]))
        for one in axes:
            one.set_title(names[1])
            one.text(0.5, 0.5, names[0])
            one.set_xticks([0, 1], names)
        axes[0].set_yscale("log")
        style.add_legend(figure, {name: Line2D([], []) for name in names})
        return figure

    figure = draw()
    style.figure_bytes(figure)
    labels = figure.axes[0].get_yticklabels()
    assert any("mathdefault" in label.get_text() for label in labels)
    assert all(label.get_parse_math() for label in labels)


def test_figure_is_saved_whole_with_150_dots_per_inch_and_text_for_papers_stays_text(tmp_path):
    for suffix, start in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        style.save_figure(Figure(), tmp_path / f"a.{suffix}")
        assert (tmp_path / f"a.{suffix}").read_bytes().startswith(start)
        with pytest.raises(ResultError, match="cannot be written"):
            style.save_figure(Figure(), tmp_path / "missing" / f"a.{suffix}")
    for name in ("a.gif", "a"):
        with pytest.raises(InputError, match=r"needs a file that ends in \.png, \.svg, \.pdf"):
            style.save_figure(Figure(), tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.pdf", "a.png", "a.svg"]
    # Width and height stand in the header of a PNG file.
    assert struct.unpack(">II", style.figure_bytes(Figure(figsize=(2.0, 1.0)))[16:24]) == (300, 150)
    figure, _ = single_panel(labels=("time [s]", ""))
    pdf, svg = style.figure_bytes(figure, "pdf"), style.figure_bytes(figure, "svg").decode()
    assert b"/Type3" not in pdf
    assert b"/TrueType" in pdf or b"/CIDFontType2" in pdf
    assert ">time [s]</text>" in svg


def test_events_that_happened_and_the_slide_are_marked_in_their_colours_named_and_have_keys():
    _, axes = single_panel()
    time_axis.mark_panels([axes], None, SlipEvents(incipient=1.5, noticed=1.6, overall=1.7), named=0)
    colours = {float(line.get_xdata()[0]): line.get_color() for line in axes.lines}
    marks = {1.5: "incipient", 1.6: "noticed", 1.7: "overall"}
    assert colours == {time: EVENT_COLOURS[name] for time, name in marks.items()}
    assert set(EVENT_NAMES) == set(EVENT_COLOURS)
    assert len(set(EVENT_COLOURS.values())) == 4
    keys = time_axis.event_keys([SlipEvents(overall=1.0), SlipEvents(), SlipEvents(incipient=1.0)])
    assert list(keys) == ["slide starts", "incipient", "overall"]
    _, axes = single_panel()
    time_axis.mark_panels([axes], HISTORY, SlipEvents())
    assert marked(axes) == [WINDOW.start]
    time_axis.mark_panels([axes], HISTORY, SlipEvents(overall=WINDOW.start + 0.5))
    assert marked(axes) == [WINDOW.start, WINDOW.start, WINDOW.start + 0.5]


def test_names_stand_beside_their_lines_and_apart_and_none_beyond_the_panel():
    _, axes = single_panel()
    axes.set_xlim(0.0, 2.0)
    time_axis.mark_panels([axes], HISTORY, SlipEvents(incipient=1.49, three_quarter=1.495, overall=1.5))
    positions = {text.get_text(): text.get_position()[0] for text in axes.texts}
    assert list(positions) == ["slide starts", "incipient", "three-quarter", "overall"]
    assert (positions["slide starts"], positions["incipient"]) == pytest.approx((0.5, 0.745))
    assert np.all(np.diff(list(positions.values())) >= 0.26 / 6.6 - 1e-9)
    # Those that had to move are led to the tops of their lines.
    assert [text.xy for text in axes.texts if text.arrow_patch] == [(0.7475, 1.0), (0.75, 1.0)]
    # A name far outside would leave the layout no room for the panels.
    _, other = single_panel()
    other.set_xlim(0.0, 2.0)
    time_axis.mark_panels([other], HISTORY, SlipEvents(incipient=1.2, overall=9.0))
    other.set_xlim(0.0, 2.0)
    assert texts(other) == ["slide starts", "incipient"]
    with style.looking("slides"):
        style.with_style(time_axis.mark_panels)([other], HISTORY, SlipEvents(three_quarter=1.495, overall=1.5))
    three_quarter, overall = (text.get_position()[0] for text in other.texts[-2:])
    assert overall - three_quarter > 1.7 * 0.39 / 6.6, "larger letters are farther apart"
    _, (axes, bare) = style.figure_grid(2, 1, (3.0, 2.0), "", ("", ""))
    axes.set_xlim(0.0, 2.0)
    time_axis.mark_panels([axes], HISTORY, EVENTS.slip)
    time_axis.mark_panels([bare], NO_SLIDE, SlipEvents())
    assert (texts(axes), texts(bare)) == ([*list(positions)[:2], "48 %", *list(positions)[2:]], [])


def test_time_shown_reaches_from_before_the_slides_to_after_overall_slip():
    window = SlideWindow(1.0, 3.0, 0, 10)
    assert time_axis.shown_span([window], [SlipEvents(overall=1.8)]) == pytest.approx((1.0, 1.8 + 0.35 * 0.8))
    assert time_axis.shown_span([window, window], [SlipEvents(overall=1.8), SlipEvents()]) == (1.0, 3.0)
    start, early = WINDOW.start, {"run": Events(slip=SlipEvents(overall=WINDOW.start + 0.1))}
    _, axes = single_panel()
    time_axis.limit_to_slides(axes, {"run": HISTORY}, {}, before=0.3)
    assert axes.get_xlim() == pytest.approx((start - 0.3 * (WINDOW.end - start), WINDOW.end))
    time_axis.limit_to_slides(axes, {"run": HISTORY}, early, before=0.0)
    assert axes.get_xlim() == pytest.approx((start, start + 0.135))
    time_axis.limit_to_slides(axes, {"run": HISTORY}, early, marked=[SlipEvents(incipient=start + 0.4)])
    assert axes.get_xlim()[1] == pytest.approx(start + 0.4 * 1.06), "beyond events of another reading"


def growing(history, kinds=("press", "hold")):
    """Return a history whose second phase is of another kind and whose records grow apart in it."""
    times = history["time"].values
    later = times > PRESS_END
    since = np.geomspace(0.01, 100.0, int(later.sum()))
    held = history.assign_coords(time=np.concatenate([times[~later], PRESS_END + since]))
    return held.assign(phase_kind=("phase", list(kinds)), phase_end=("phase", [PRESS_END, PRESS_END + 100.0]))


def test_records_that_grow_apart_are_shown_since_the_hold_began_and_even_ones_as_they_are():
    even, held = time_axis.shown_time(HISTORY), time_axis.shown_time(growing(HISTORY))
    assert (even.logarithmic, even.label) == (False, "time [s]")
    np.testing.assert_array_equal(even.values, HISTORY["time"].values)
    assert (held.logarithmic, held.label) == (True, "time since the hold began [s]")
    later = growing(HISTORY)["time"].values > PRESS_END
    assert np.isnan(held.values[~later]).all()
    assert (np.nanmin(held.values), np.nanmax(held.values)) == pytest.approx((0.01, 100.0))
    pressed = growing(HISTORY, ("press", "press")).isel(time=slice(int(PRESS_END / 5e-3), None))
    without = time_axis.shown_time(pressed.assign_coords(time=pressed["time"].values - PRESS_END))
    assert (without.logarithmic, without.label) == (True, "time [s]")
    assert np.isnan(without.values[0])
    assert [time.logarithmic for time in time_axis.shown_times((growing(HISTORY), growing(HISTORY)))] == [True, True]
    assert [time.logarithmic for time in time_axis.shown_times((growing(HISTORY), HISTORY))] == [False, False]
    assert (pictures.is_held(HISTORY), pictures.is_held(growing(HISTORY))) == (False, True)


@pytest.mark.parametrize(
    "draw",
    [
        signals.force_figure,
        signals.energy_figure,
        signals.strain_energy_density_figure,
        lambda history: signals.force_overview_figure({"held": history}, {}),
        lambda history: signals.slip_maps_figure({"held": history}, {}),
    ],
)
def test_figures_over_time_take_the_axis(draw):
    figure = draw(growing(HISTORY))
    figure.draw_without_rendering()
    lowest = panels(figure)[-1]
    assert lowest.get_xscale() == "log"
    assert lowest.get_xlabel() == "time since the hold began [s]"
    assert lowest.get_xlim() == pytest.approx((0.01, 100.0), rel=0.1)
