"""Figures over the runs of a study: events and latency over swept values, refinements, samples, pairs of runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerslip.published import published_set
from fingerslip.report.figures.study import (
    Pair,
    convergence_figure,
    event_times_figure,
    indices_figure,
    latency_figure,
    paired_figure,
    tornado_figure,
)
from fingerslip.results import RunResult
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.slip import Events, SlipEvents
from fingerslip.uncertainty import Convergence, Series
from unit.report.figures.made import panels, titles, words
from unit.report.tables.runs import sensitivity
from unit.sampled import study_of

TABLE2 = published_set("wang2014-table2")
FRICTION = "contact.friction_coefficient"
SLIPPED = Events(slip=SlipEvents(1.5, None, 1.6, 1.7))


def swept_runs() -> list[RunResult]:
    def events(friction: float) -> Events:
        overall = 1.0 + 0.71 * friction / 0.6
        times = SlipEvents(overall - 0.18, None, overall - 0.05, overall)
        return Events(times, times, SlipEvents(None, None, None, overall))

    return [
        RunResult(
            f"{variant} {friction}",
            {"fingertip.phalanx.variant": variant, FRICTION: friction},
            events(friction),
            values={**TABLE2.values[0].programme, "fingertip.fingerprint.enabled": False},
        )
        for variant in ("original", "scaled")
        for friction in (0.2, 0.6, 0.8)
    ]


def runs_over(path: str, *values: Any, events: Events = SLIPPED) -> list[RunResult]:
    return [RunResult(str(value), {path: value}, events) for value in values]


def diamonds(axes: Axes) -> list[tuple[float, float]]:
    """Return where published values are drawn."""
    return sorted((line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines if line.get_marker() == "D")


def ticks(axes: Axes) -> list[str]:
    return [label.get_text() for label in axes.get_xticklabels()]


def test_event_times_have_a_panel_for_each_phalanx_and_the_published_values_that_hold() -> None:
    figure = event_times_figure([*swept_runs(), RunResult("other", {}, Events())], reference=TABLE2)
    first, second = panels(figure)
    assert titles(figure) == ["phalanx original", "phalanx scaled"]
    assert diamonds(first) == [(0.6, 1.53), (0.6, 1.71)]
    assert diamonds(second) == [(0.6, 1.48), (0.6, 1.77)], "those of the scaled phalanx at 0.6, and no latency"
    overall = first.lines[6]
    assert list(overall.get_xdata()) == list(first.get_xticks()) == [0.2, 0.6, 0.8]
    assert overall.get_ydata()[1] == pytest.approx(1.71)
    assert {"friction coefficient", "time from the start of the run [s]", "published"} <= words(figure)


def test_latency_is_in_milliseconds_and_missing_where_an_event_is() -> None:
    figure = latency_figure(swept_runs(), reference=TABLE2)
    axes = panels(figure)[1]
    assert axes.get_title(loc="left") == "friction coefficient 0.6"
    slip, _, acceleration = axes.lines[:3]
    assert slip.get_ydata() == pytest.approx([180.0, 180.0])
    assert np.isnan(acceleration.get_ydata()).all()
    assert sorted(value for _, value in diamonds(axes)) == pytest.approx([180.0, 290.0])
    assert "published" not in words(latency_figure(swept_runs()))
    missing = runs_over(FRICTION, 0.2, 0.4, events=Events(slip=SlipEvents(1.5, None, None, 1.7)))
    lines = panels(event_times_figure(missing))[0].lines
    incipient, three_quarter = (np.asarray(lines[index].get_ydata(), dtype=float) for index in (0, 3))
    assert incipient.tolist() == [1.5, 1.5]
    assert np.isnan(three_quarter).all()


def test_the_axis_has_numbers_to_scale_where_all_have_one_unit_and_else_words_in_order() -> None:
    words_axes = panels(event_times_figure(swept_runs(), "fingertip.phalanx.variant"))[0]
    assert words_axes.get_title(loc="left") == "friction coefficient 0.2"
    assert (ticks(words_axes), list(words_axes.get_xticks())) == (["original", "scaled"], [0, 1])
    angle = "fingertip.solid.angle"
    axes = panels(event_times_figure(runs_over(angle, "30 deg", "-15 deg", "15 deg"), angle))[0]
    assert (ticks(axes), list(axes.get_xticks())) == (["30 deg", "-15 deg", "15 deg"], [30.0, -15.0, 15.0])
    assert list(axes.lines[0].get_xdata()) == [-15.0, 15.0, 30.0], "joined in order"
    mixed = panels(event_times_figure(runs_over(angle, "30 deg", "0.5 rad"), angle))[0]
    assert list(mixed.get_xticks()) == [0, 1], "no common scale"
    direction = "programme.1.slide.direction"
    axes = panels(latency_figure(runs_over(direction, [1, 0, 0], [-1, 0, 0]), direction))[0]
    assert ticks(axes) == ["1, 0, 0", "-1, 0, 0"]


@pytest.mark.parametrize("draw", [event_times_figure, latency_figure])
def test_only_readings_that_were_recorded_have_a_key_and_panels_can_be_read(draw: Callable[..., Figure]) -> None:
    silent = Events(SLIPPED.slip, acceleration=SlipEvents(recorded=False))
    heard, never = Events(SLIPPED.slip, acceleration=SLIPPED.slip), Events(SLIPPED.slip, acceleration=SlipEvents())
    for events, is_named in ((silent, False), (heard, True), (never, False)):
        keys = words(draw(runs_over(FRICTION, 0.2, 0.4, events=events), FRICTION))
        assert ("acceleration peaks" in keys) == is_named
        assert "accumulated slip" in keys
    runs = [
        RunResult(f"{depth}-{mu}", {FRICTION: mu, "mesh.depth": depth}, SLIPPED)
        for depth in range(20)
        for mu in (0.2, 0.4)
    ]
    figure = draw(runs, FRICTION)
    assert len(titles(figure)) == 12
    assert (titles(figure)[0][-1:], titles(figure)[-1][-2:]) == ("0", "19")
    assert "12 of 20 combinations of the other values" in " ".join(figure.get_suptitle().split())


def refined(*values: float | None) -> Convergence:
    sources = {name: Series(name, (1.0, 0.5, 0.25), values) for name in ("mesh", "step")}
    return Convergence("event", "s", values[0], sources)


def test_changes_are_in_milliseconds_for_each_refined_setting_and_the_curve_ends_at_the_limit() -> None:
    quantities = {
        "slip.incipient": refined(1.2, 1.3, 1.25),
        "slip.three_quarter": refined(None, None, None),
        "slip.overall": refined(1.8, 1.75, 1.725),
    }
    figure = convergence_figure(quantities, "run")
    assert [axes.get_xlabel() for axes in panels(figure)] == ["element size / that in use", "time step / that in use"]
    points = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert len(points) == 2, "the event that did not happen is left out"
    assert sorted(np.asarray(points[1].get_ydata()).tolist()) == pytest.approx([-75.0, -50.0, 0.0])
    (limit,) = (line for line in figure.axes[0].lines if line.get_marker() == "D")
    assert list(limit.get_ydata()) == pytest.approx([-100.0], abs=1e-3)


def overall_fits(*variants: str):  # type: ignore[no-untyped-def]
    return [fit for fit in fits_of(study_of(12, variants)) if fit.time == "overall"]


def test_bars_go_from_the_time_at_the_smallest_to_that_at_the_largest_value() -> None:
    figure = tornado_figure(overall_fits("original"))
    (axes,) = panels(figure)
    bars = [(bar.get_x(), bar.get_x() + bar.get_width(), bar.get_y() + 0.5 * bar.get_height()) for bar in axes.patches]
    smallest, largest = bars[2:5], bars[5:8]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert [label.partition(",")[0] for label in labels] == ["Poisson's ratio", "half height", "clearance"]
    assert labels[2] == "clearance, 0 to 0.4 mm"
    # Overall slip is at 1.8 s without clearance and at 1.6 s with 0.4 mm of it.
    assert smallest[2] == (pytest.approx(1.7), pytest.approx(1.8), pytest.approx(2.0))
    assert largest[2][1] == pytest.approx(1.6)
    assert "published" not in words(figure)


def test_panels_share_the_order_of_the_values_and_have_their_own_published_time() -> None:
    figure = tornado_figure(overall_fits("original", "scaled"), {0: (1.71, 1.71), 1: (1.75, 1.77)})
    assert titles(figure) == ["phalanx original", "phalanx scaled"]
    dashed = [[line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == "--"] for axes in panels(figure)]
    assert dashed == [[1.71], [1.75, 1.77]]
    assert {"published", "at the smallest value", "5 to 95 % of the samples"} <= words(figure)


@pytest.mark.parametrize(
    ("method", "keys", "label"),
    [
        ("sobol", {"total", "first order"}, "Sobol index [-]"),
        ("morris", {"mean size", "standard deviation"}, "elementary effect [s]"),
    ],
)
def test_indices_are_bars_in_a_panel_for_each_group(method: str, keys: set[str], label: str) -> None:
    figure = indices_figure([sensitivity(method)])
    (axes,) = panels(figure)
    assert [bar.get_width() for bar in axes.patches] == [0.3, 0.6, 0.2, 0.5]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["press depth", "friction coefficient"]
    assert keys | {label} <= words(figure)
    groups = [sensitivity(method, group={"fingertip.phalanx.variant": name}) for name in ("original", "scaled")]
    assert titles(indices_figure(groups)) == ["phalanx original", "phalanx scaled"]


def test_each_pair_has_a_row_with_both_studies() -> None:
    slipped = RunResult("a", {}, Events(slip=SlipEvents(incipient=1.2, overall=1.7)))
    pairs = (Pair("one", slipped, slipped), Pair("two", slipped, RunResult("a", {}, Events())))
    left, right = panels(paired_figure(pairs, ("A", "B"), ({"a": 1.0}, {"a": 1.1})))
    marks = [line for line in left.lines if line.get_marker() in "os"]
    assert [round(float(line.get_xdata()[0]), 3) for line in marks[:2]] == [0.7, 0.6]
    assert np.isnan(marks[3].get_xdata()[0])
    assert float(right.lines[1].get_xdata()[0]) == np.float64(500.0)
    assert [text.get_text() for text in left.get_yticklabels()] == ["one", "two"]
