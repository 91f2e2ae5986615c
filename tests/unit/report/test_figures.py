"""Figures show what they say: labels with units, marked events, one panel for each run."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import skfem
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from synthetic import KINDS, PRESS_END, Process, make

from fingerslip.errors import ResultError
from fingerslip.report.figure_style import shown_until
from fingerslip.report.figures import (
    acceleration_figure,
    acceleration_overview_figure,
    contact_displacement_figure,
    energy_figure,
    event_times_figure,
    figure_bytes,
    force_figure,
    force_overview_figure,
    latency_figure,
    save_figure,
    section_figure,
    slip_maps_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures_section import receptor_positions
from fingerslip.report.published import published
from fingerslip.report.tables import RunEvents
from fingerslip.slip import Events, SlideWindow, SlipEvents, find_events

HISTORY = make(Process())
EVENTS = find_events(HISTORY)
HISTORIES = {f"run {number}": HISTORY for number in range(5)}
ALL = dict.fromkeys(HISTORIES, EVENTS)
NO_SLIDE = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
APART = HISTORY.assign(contact_state=HISTORY["contact_state"] * 0)
BARE = HISTORY.drop_dims("site")


def panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_visible()]


def marked(axes: Axes) -> list[float]:
    """Return the times of the vertical lines of a panel [s]."""
    lines = [np.asarray(line.get_xdata(), dtype=float) for line in axes.lines]
    return sorted(float(x[0]) for x in lines if x.size == 2 and x[0] == x[1])


def words(figure: Figure) -> set[str]:
    supers = {figure.get_suptitle(), figure.get_supylabel()}
    labels = {text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel())}
    keys = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    return supers | labels | keys


def test_slip_map_has_a_panel_for_each_run_and_marks_its_events() -> None:
    figure = slip_maps_figure(HISTORIES, ALL)
    assert [axes.get_title(loc="left") for axes in panels(figure)] == list(HISTORIES)
    times = [PRESS_END, EVENTS.slip.incipient, EVENTS.slip.three_quarter, EVENTS.slip.overall]
    assert marked(panels(figure)[0]) == pytest.approx(times)
    assert {"time [s]", "position along the plate [mm]", "no contact", "stick", "slip"} <= words(figure)


def test_slip_map_shows_the_states_themselves() -> None:
    (axes,) = panels(slip_maps_figure({"a": HISTORY}, {}))
    values = np.asarray(axes.collections[0].get_array())
    assert values.shape == (41, HISTORY.sizes["time"])
    assert set(np.unique(values)) == {0, 1, 2}
    # The centre sticks longest.
    assert (values == 1).sum(axis=1).argmax() == 20


def test_displacement_has_nine_nodes_and_the_plate() -> None:
    axes = panels(contact_displacement_figure(HISTORY, EVENTS))[0]
    curves = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert len(curves) == 10
    plate = curves[-1].get_ydata()
    assert plate[-1] == pytest.approx(3.0)
    assert max(line.get_ydata()[-1] for line in curves[:-1]) == pytest.approx(3.0 * 0.71, abs=0.03)
    assert axes.get_ylabel() == "" or "mm" in axes.get_ylabel()


def test_acceleration_has_the_four_types_on_one_scale() -> None:
    figure = acceleration_figure(HISTORY, EVENTS, "original")
    assert [axes.get_title(loc="left") for axes in panels(figure)] == ["FA-I", "SA-I", "FA-II", "SA-II"]
    assert len({axes.get_ylim() for axes in panels(figure)}) == 1
    assert all(marked(axes)[-1] == EVENTS.acceleration.overall for axes in panels(figure))
    assert {"acceleration along the plate [m/s²]", "Acceleration at the receptors: original"} <= words(figure)


def test_transition_does_not_set_the_scale() -> None:
    weak = make(Process(peaks={1.5: 0.02, 1.71: 0.1}))
    top = panels(acceleration_figure(weak))[0].get_ylim()[1]
    assert 0.05 < top < 0.15


def test_density_starts_at_zero_with_both_areas() -> None:
    figure = strain_energy_density_figure(HISTORY, EVENTS)
    assert all(axes.get_ylim()[0] == 0.0 for axes in panels(figure))
    assert "strain energy density [J/m³]" in words(figure)
    area_a, area_b = (line for line in panels(figure)[0].lines if len(line.get_xdata()) > 2)
    assert area_b.get_ydata()[-1] > area_a.get_ydata()[-1]


def test_force_figure_has_units_and_ratio_at_the_friction_coefficient() -> None:
    forces, ratios = panels(force_figure(HISTORY, EVENTS))
    assert forces.get_ylabel() == "force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    ratio = next(line for line in ratios.lines if line.get_label() == "tangential / normal force")
    assert ratio.get_ydata()[-1] == pytest.approx(0.6)


def test_overviews_have_a_panel_for_each_run() -> None:
    for figure in (force_overview_figure(HISTORIES, ALL), acceleration_overview_figure(HISTORIES, ALL)):
        assert [axes.get_title(loc="left") for axes in panels(figure)] == list(HISTORIES)


def test_peaks_that_count_are_dotted() -> None:
    axes = panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]
    dots = next(line for line in axes.lines if line.get_marker() == "o")
    assert list(dots.get_xdata()) == pytest.approx([1.53, 1.63, 1.71], abs=0.0051)


def test_energy_balance_keeps_small_parts_apart() -> None:
    large, small = panels(energy_figure(HISTORY))
    assert large.get_ylabel() == "energy [µJ]"
    assert "imbalance" in {line.get_label() for line in small.lines}


def swept_runs() -> list[RunEvents]:
    def events(friction: float) -> Events:
        overall = 1.0 + 0.71 * friction / 0.6
        times = SlipEvents(overall - 0.18, None, overall - 0.05, overall)
        return Events(times, times, SlipEvents(None, None, None, overall))

    return [
        RunEvents(
            f"{variant} {friction}",
            {"fingertip.phalanx.variant": variant, "contact.friction_coefficient": friction},
            events(friction),
            {"fingertip.fingerprint.enabled": False},
        )
        for variant in ("original", "scaled")
        for friction in (0.2, 0.6, 0.8)
    ]


def test_event_times_have_a_panel_for_each_phalanx_and_the_published_values() -> None:
    figure = event_times_figure(swept_runs(), reference=published("wang2014-table2"))
    assert [axes.get_title(loc="left") for axes in panels(figure)] == ["phalanx original", "phalanx scaled"]
    diamonds = [line.get_ydata()[0] for line in panels(figure)[0].lines if line.get_marker() == "D"]
    assert sorted(diamonds) == [1.53, 1.71]
    overall = panels(figure)[0].lines[6]
    assert list(overall.get_xdata()) == [0.2, 0.6, 0.8]
    assert overall.get_ydata()[1] == pytest.approx(1.71)
    assert {"friction coefficient", "time from the start of the run [s]", "published"} <= words(figure)


def test_latency_is_in_milliseconds_and_missing_where_an_event_is() -> None:
    figure = latency_figure(swept_runs(), reference=published("wang2014-table2"))
    axes = panels(figure)[1]
    assert axes.get_title(loc="left") == "friction coefficient 0.6"
    slip, _, acceleration = axes.lines[:3]
    assert slip.get_ydata() == pytest.approx([180.0, 180.0])
    assert np.isnan(acceleration.get_ydata()).all()
    diamonds = [line.get_ydata()[0] for line in axes.lines if line.get_marker() == "D"]
    assert diamonds == pytest.approx([180.0, 290.0])
    assert "published" not in words(latency_figure(swept_runs()))


def test_section_fills_regions_and_moves_with_the_displacement() -> None:
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 4e-3, 9), np.linspace(0.0, 2e-3, 5))
    mesh = mesh.with_subdomains({"tissue": lambda x: x[1] > 1e-3, "epidermis": lambda x: x[1] < 1e-3})
    receptors = {"FA-I": np.array([[1e-3, 0.5e-3]])}
    still = section_figure(mesh, receptors)
    lifted = section_figure(mesh, receptors, np.full((mesh.p.shape[1], 2), 1e-3), plate=0.0)
    dots = [next(line for line in panels(f)[0].lines if line.get_marker() == "o") for f in (still, lifted)]
    assert [dot.get_ydata()[0] for dot in dots] == pytest.approx([0.5, 1.5])
    assert sum(len(c.get_paths()) for c in panels(still)[0].collections) == mesh.t.shape[1]
    assert {"x [mm]", "y [mm]", "epidermis", "tissue", "FA-I", "plate"} <= words(still)


def test_receptor_positions_are_sorted_by_type() -> None:
    assert {kind: places.shape for kind, places in receptor_positions(HISTORY).items()} == dict.fromkeys(KINDS, (25, 2))
    assert receptor_positions(BARE) == {}


@pytest.mark.parametrize("history", [NO_SLIDE, APART, BARE], ids=["no slide", "no contact", "no receptors"])
def test_figures_of_incomplete_histories_can_be_drawn(history: object) -> None:
    figures = (
        slip_maps_figure({"a": history}, {"a": Events()}),
        contact_displacement_figure(history, Events()),
        acceleration_overview_figure({"a": history}, {}),
        force_figure(history, Events()),
        force_overview_figure({"a": history}, {}),
    )
    assert all(len(figure_bytes(figure)) > 5_000 for figure in figures)


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


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_figure_is_saved_whole(tmp_path: Path, suffix: str, start: bytes) -> None:
    save_figure(energy_figure(HISTORY), tmp_path / f"a.{suffix}")
    assert (tmp_path / f"a.{suffix}").read_bytes().startswith(start)
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]


def test_figure_that_cannot_be_saved_says_so(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="cannot be written"):
        save_figure(energy_figure(HISTORY), tmp_path / "missing" / "a.png")
