"""Figures over the runs of a study."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerslip.published import published_set
from fingerslip.report.figures.study import convergence_figure, event_times_figure, latency_figure
from fingerslip.results import RunResult
from fingerslip.slip import Events, SlipEvents
from fingerslip.uncertainty import Convergence, Series
from unit.report.figures.made import panels, words


def swept_runs() -> list[RunResult]:
    def events(friction: float) -> Events:
        overall = 1.0 + 0.71 * friction / 0.6
        times = SlipEvents(overall - 0.18, None, overall - 0.05, overall)
        return Events(times, times, SlipEvents(None, None, None, overall))

    return [
        RunResult(
            f"{variant} {friction}",
            {"fingertip.phalanx.variant": variant, "contact.friction_coefficient": friction},
            events(friction),
            values={**published_set("wang2014-table2").values[0].programme, "fingertip.fingerprint.enabled": False},
        )
        for variant in ("original", "scaled")
        for friction in (0.2, 0.6, 0.8)
    ]


def test_event_times_have_a_panel_for_each_phalanx_and_the_published_values() -> None:
    figure = event_times_figure(swept_runs(), reference=published_set("wang2014-table2"))
    assert [axes.get_title(loc="left") for axes in panels(figure)] == ["phalanx original", "phalanx scaled"]
    diamonds = [line.get_ydata()[0] for line in panels(figure)[0].lines if line.get_marker() == "D"]
    assert sorted(diamonds) == [1.53, 1.71]
    overall = panels(figure)[0].lines[6]
    assert list(overall.get_xdata()) == [0.2, 0.6, 0.8]
    assert overall.get_ydata()[1] == pytest.approx(1.71)
    assert {"friction coefficient", "time from the start of the run [s]", "published"} <= words(figure)


def test_latency_is_in_milliseconds_and_missing_where_an_event_is() -> None:
    figure = latency_figure(swept_runs(), reference=published_set("wang2014-table2"))
    axes = panels(figure)[1]
    assert axes.get_title(loc="left") == "friction coefficient 0.6"
    slip, _, acceleration = axes.lines[:3]
    assert slip.get_ydata() == pytest.approx([180.0, 180.0])
    assert np.isnan(acceleration.get_ydata()).all()
    diamonds = [line.get_ydata()[0] for line in axes.lines if line.get_marker() == "D"]
    assert diamonds == pytest.approx([180.0, 290.0])
    assert "published" not in words(latency_figure(swept_runs()))


def test_runs_without_the_swept_value_are_left_out() -> None:
    runs = [*swept_runs(), RunResult("other", {}, Events())]
    assert len(panels(event_times_figure(runs))) == 2


def test_published_values_are_shown_only_where_their_conditions_hold() -> None:
    axes = panels(event_times_figure(swept_runs(), reference=published_set("wang2014-table2")))[1]
    diamonds = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines if line.get_marker() == "D"]
    assert sorted(diamonds) == [(0.6, 1.48), (0.6, 1.77)], "those of the scaled phalanx at 0.6, and no latency"


def test_words_on_the_axis_stand_in_order_of_appearance() -> None:
    figure = event_times_figure(swept_runs(), "fingertip.phalanx.variant")
    axes = panels(figure)[0]
    assert axes.get_title(loc="left") == "friction coefficient 0.2"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["original", "scaled"]
    assert list(axes.get_xticks()) == [0, 1]
    assert "phalanx" in words(figure)


def test_numbers_on_the_axis_are_to_scale() -> None:
    axes = panels(event_times_figure(swept_runs()))[0]
    assert list(axes.get_xticks()) == [0.2, 0.6, 0.8]


def test_a_missing_event_is_left_out_of_its_curve() -> None:
    times = SlipEvents(1.5, None, None, 1.7)
    runs = [RunResult(str(mu), {"contact.friction_coefficient": mu}, Events(slip=times)) for mu in (0.2, 0.4)]
    axes = panels(event_times_figure(runs))[0]
    incipient, three_quarter = (np.asarray(axes.lines[index].get_ydata(), dtype=float) for index in (0, 3))
    assert incipient.tolist() == [1.5, 1.5]
    assert np.isnan(three_quarter).all()


def test_swept_lists_and_signed_angles_keep_their_text_on_the_axis() -> None:
    events = Events(slip=SlipEvents(1.5, None, 1.6, 1.7))
    angles = [RunResult(angle, {"fingertip.solid.angle": angle}, events) for angle in ("-30 deg", "30 deg")]
    axes = panels(event_times_figure(angles, "fingertip.solid.angle"))[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["-30 deg", "30 deg"]
    directions = [RunResult(str(x), {"programme.1.slide.direction": [x, 0, 0]}, events) for x in (1, -1)]
    axes = panels(latency_figure(directions, "programme.1.slide.direction"))[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1, 0, 0", "-1, 0, 0"]


def test_quantities_in_one_unit_are_to_scale_and_joined_in_order() -> None:
    events = Events(slip=SlipEvents(1.5, None, 1.6, 1.7))

    def drawn(*angles: str) -> Axes:
        runs = [RunResult(angle, {"fingertip.solid.angle": angle}, events) for angle in angles]
        return panels(event_times_figure(runs, "fingertip.solid.angle"))[0]

    axes = drawn("30 deg", "-15 deg", "15 deg")
    assert list(axes.get_xticks()) == [30.0, -15.0, 15.0]
    assert list(axes.lines[0].get_xdata()) == [-15.0, 15.0, 30.0]
    assert list(drawn("30 deg", "0.5 rad").get_xticks()) == [0, 1], "no common scale"


@pytest.mark.parametrize("draw", [event_times_figure, latency_figure])
def test_a_reading_that_no_run_recorded_has_no_key(draw: Callable[..., Figure]) -> None:
    path = "contact.friction_coefficient"
    silent = Events(SlipEvents(1.5, None, 1.6, 1.7), acceleration=SlipEvents(recorded=False))
    runs = [RunResult(str(friction), {path: friction}, silent) for friction in (0.2, 0.4)]
    assert "acceleration peaks" not in words(draw(runs, path))
    heard = Events(SlipEvents(1.5, None, 1.6, 1.7), acceleration=SlipEvents(1.5, None, 1.6, 1.7))
    runs = [RunResult(str(friction), {path: friction}, heard) for friction in (0.2, 0.4)]
    assert "acceleration peaks" in words(draw(runs, path))


def test_a_reading_without_any_latency_has_no_key() -> None:
    path = "contact.friction_coefficient"
    never = Events(SlipEvents(1.5, None, 1.6, 1.7), acceleration=SlipEvents(None, None, None, 1.7))
    runs = [RunResult(str(friction), {path: friction}, never) for friction in (0.2, 0.4)]
    shown = words(latency_figure(runs, path))
    assert "accumulated slip" in shown
    assert "acceleration peaks" not in shown


@pytest.mark.parametrize("draw", [latency_figure, event_times_figure])
def test_of_many_combinations_as_many_as_can_be_read_have_a_panel(draw: Callable[..., Figure]) -> None:
    events = Events(slip=SlipEvents(incipient=1.1, overall=1.4))
    runs = [
        RunResult(f"{depth}-{mu}", {"contact.friction_coefficient": mu, "mesh.depth": depth}, events)
        for depth in range(20)
        for mu in (0.2, 0.4)
    ]
    figure = draw(runs, "contact.friction_coefficient")
    titles = [axes.get_title(loc="left") for axes in panels(figure)]
    assert len(titles) == 12
    assert titles[0].endswith("0")
    assert titles[-1].endswith("19")
    assert "12 of 20 combinations of the other values" in " ".join(figure.get_suptitle().split())


SIZES = (1.0, 0.5, 0.25)


def event(*values: float | None) -> Convergence:
    sources = {name: Series(name, SIZES, values) for name in ("mesh", "step")}
    return Convergence("event", "s", values[0], sources)


QUANTITIES = {
    "slip.incipient": event(1.2, 1.3, 1.25),
    "slip.three_quarter": event(None, None, None),
    "slip.overall": event(1.8, 1.75, 1.725),
}


def test_there_is_a_panel_for_each_refined_setting() -> None:
    figure = convergence_figure(QUANTITIES, "run")
    labels = [axes.get_xlabel() for axes in figure.axes if axes.get_visible()]
    assert labels == ["element size / that in use", "time step / that in use"]


def test_changes_are_in_milliseconds_and_the_curve_ends_at_the_limit() -> None:
    axes = convergence_figure(QUANTITIES, "run").axes[0]
    points = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(points) == 2  # the event that did not happen is left out
    changes = sorted(np.asarray(points[1].get_ydata()).tolist())
    assert changes == pytest.approx([-75.0, -50.0, 0.0])
    (limit,) = (line for line in axes.lines if line.get_marker() == "D")
    assert list(limit.get_ydata()) == pytest.approx([-100.0], abs=1e-3)
