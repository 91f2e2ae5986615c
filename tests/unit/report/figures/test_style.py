"""The look of all figures, and how they are saved."""

from __future__ import annotations

import struct
from pathlib import Path

import matplotlib as mpl
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fingerslip.errors import ResultError
from fingerslip.report.colours import region_colours
from fingerslip.report.figures import style
from fingerslip.report.figures.contact import (
    contact_displacement_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    slip_maps_figure,
)
from fingerslip.report.figures.receptors import (
    acceleration_figure,
    acceleration_overview_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures.style import (
    add_legend,
    columns_for,
    figure_bytes,
    figure_grid,
    join_title,
    run_panels,
    save_figure,
    say,
    with_style,
)
from fingerslip.slip import Events
from unit.report.figures.made import APART, BARE, HISTORY, NO_SLIDE, panels


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
        [max(min(columns, count) * 3.0 + 0.6, 5.2), rows * 2 + 0.8]
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


@pytest.mark.parametrize(("names", "columns"), [(["a", "b"], 2), (["a rather long name of a key"] * 8, 2)])
def test_legend_takes_as_many_columns_as_the_figure_is_wide(names: list[str], columns: int) -> None:
    figure, _ = figure_grid(1, 1, (6.0, 2.0), "", ("", ""))
    keys = {f"{name}{index}": Line2D([], []) for index, name in enumerate(names)}
    add_legend(figure, keys)
    (legend,) = figure.legends
    assert legend._ncols == columns
    assert [text.get_text() for text in legend.get_texts()] == list(keys)


def test_drawing_takes_the_style_also_where_it_fails() -> None:
    @with_style
    def fail() -> None:
        assert mpl.rcParams["font.size"] == 9.0
        raise ZeroDivisionError

    with mpl.rc_context({"font.size": 33.0}):
        with pytest.raises(ZeroDivisionError):
            fail()
        assert mpl.rcParams["font.size"] == 33.0


def test_titles_say_what_tells_them_apart() -> None:
    assert (join_title("Forces", "run 1"), join_title("Forces", "")) == ("Forces: run 1", "Forces")


def test_runs_have_a_panel_each_under_their_titles() -> None:
    titles = ("angle -30 deg", "a rather long title of a run, which is wider than its panel, friction coefficient 0.6")
    figure, axes = with_style(run_panels)(titles, "All runs", ("time [s]", "force [N]"))
    shown = [panel.get_title(loc="left") for panel in axes]
    assert shown[0] == "angle -30 deg"
    assert shown[1].replace("\n", " ") == titles[1]
    assert "\n" in shown[1]
    assert figure.get_suptitle() == "All runs"


def test_long_titles_of_figures_are_wrapped_and_nothing_is_lost() -> None:
    title = "Forces and slipping area: " + ", ".join(["friction coefficient 0.6"] * 6)
    figure, _ = figure_grid(1, 1, (6.0, 2.0), title, ("", ""))
    assert figure.get_suptitle().replace("\n", " ") == title
    figure.draw_without_rendering()
    box = figure._suptitle.get_window_extent()  # type: ignore[attr-defined]
    assert box.x1 <= figure.bbox.x1


def test_an_empty_panel_says_why() -> None:
    _, (axes,) = figure_grid(1, 1, (3.0, 2.0), "", ("", ""))
    say(axes, "nothing here", 0.3)
    (text,) = axes.texts
    assert (text.get_text(), text.get_position()[1]) == ("nothing here", 0.3)


def test_regions_that_have_no_colour_of_their_own_take_others_in_turn() -> None:
    colours = region_colours(["b", "tissue", "a", "epidermis"])
    assert list(colours) == ["epidermis", "tissue", "b", "a"]
    assert colours["a"] != colours["b"]
    assert len(region_colours([str(number) for number in range(6)])) == 6


def test_a_figure_without_keys_has_no_legend() -> None:
    figure, _ = figure_grid(1, 1, (2.0, 2.0), "nothing", ("x", "y"))
    add_legend(figure, {})
    assert figure.legends == []


def test_a_long_legend_takes_no_height_of_the_panels_and_no_room_of_the_label() -> None:
    figure, (axes,) = figure_grid(1, 1, (3.0, 1.5), "", ("x", "a label that is longer than its panel is high [s]"))
    before = figure.get_figheight()
    add_legend(figure, {f"a key that is rather long, {number}": Line2D([], []) for number in range(8)})
    figure.canvas.draw()
    (legend,), label = figure.legends, figure._supylabel
    assert figure.get_figheight() > before + 0.5
    assert axes.get_window_extent().height > 0.5 * before * figure.dpi
    assert label.get_window_extent().y0 > legend.get_window_extent().y1


def test_a_legend_has_as_many_columns_as_fit() -> None:
    assert style._legend_columns([1.0] * 4, 4.0) == 4
    assert style._legend_columns([1.0, 1.0, 3.0, 1.0], 4.5) == 2
    assert style._legend_columns([9.0, 9.0], 5.0) == 1


def test_dollars_of_titles_and_values_are_no_mathematics() -> None:
    names = ["cheap $\\frac{$", "dear $x_{$"]

    @with_style
    def draw() -> Figure:
        figure, axes = figure_grid(2, 2, (2.0, 2.0), names[0], (names[0], names[1]))
        for one in axes:
            one.set_title(names[1])
            one.text(0.5, 0.5, names[0])
            one.set_xticks([0, 1], names)
        axes[0].set_yscale("log")
        add_legend(figure, {name: Line2D([], []) for name in names})
        return figure

    figure = draw()
    figure_bytes(figure)
    shown = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert any("mathdefault" in label for label in shown)
    assert all(label.get_parse_math() for label in figure.axes[0].get_yticklabels())


@pytest.mark.parametrize(
    "history",
    [
        pytest.param(NO_SLIDE, id="no slide", marks=pytest.mark.slow),
        pytest.param(APART, id="no contact"),
        pytest.param(BARE, id="no receptors"),
    ],
)
def test_figures_of_incomplete_histories_are_drawn_without_a_warning(history: xr.Dataset) -> None:
    figures = (
        slip_maps_figure({"a": history}, {"a": Events()}),
        contact_displacement_figure(history, Events()),
        acceleration_figure(history, Events()),
        acceleration_overview_figure({"a": history}, {}),
        strain_energy_density_figure(history, Events()),
        force_figure(history, Events()),
        force_overview_figure({"a": history}, {}),
        energy_figure(history),
    )
    for figure in figures:
        assert figure_bytes(figure).startswith(b"\x89PNG")


def test_pictures_have_150_dots_per_inch() -> None:
    # Width and height stand in the header of a PNG file.
    assert struct.unpack(">II", figure_bytes(Figure(figsize=(2.0, 1.0)))[16:24]) == (300, 150)


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_figure_is_saved_whole(tmp_path: Path, suffix: str, start: bytes) -> None:
    save_figure(energy_figure(HISTORY), tmp_path / f"a.{suffix}")
    assert (tmp_path / f"a.{suffix}").read_bytes().startswith(start)
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]


def test_text_of_figures_for_papers_stays_text() -> None:
    figure = energy_figure(HISTORY)
    pdf, svg = figure_bytes(figure, "pdf"), figure_bytes(figure, "svg").decode()
    assert b"/Type3" not in pdf
    assert b"/TrueType" in pdf or b"/CIDFontType2" in pdf
    assert ">time [s]</text>" in svg


def test_figure_that_cannot_be_saved_says_so(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="cannot be written"):
        save_figure(energy_figure(HISTORY), tmp_path / "missing" / "a.png")
