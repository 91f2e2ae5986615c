"""Figures of what a detector needs and uses."""

from __future__ import annotations

import pytest

from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.report.figures.markers import importance_figure, learning_curve_figure, robustness_figure


def test_a_learning_curve_shows_accuracy_and_f1() -> None:
    (axes,) = learning_curve_figure(
        [(4, Estimate(0.7, 0.6, 0.8), Estimate(0.6, 0.5, 0.7)), (8, Estimate(0.8, 0.7, 0.9), Estimate(0.75))]
    ).axes
    assert [line.get_ydata().tolist() for line in axes.get_lines()] == [[0.7, 0.8], [0.6, 0.75]]
    bars = [path.vertices[:, 1].tolist() for path in axes.collections[0].get_paths()]
    assert bars == [[0.6, 0.8], [0.7, 0.9]]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["4", "8"]


def test_every_ring_has_a_bar() -> None:
    (axes,) = importance_figure({0: Estimate(0.02, 0.01, 0.03), 1: Estimate(-0.01, -0.02, 0.0)}).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0.02, -0.01])


def test_every_disturbance_has_a_panel_and_no_accuracy_where_nothing_is_classified() -> None:
    right = Estimate(0.9, 0.8, 1.0)
    rows = [("lost", 0.0, right, 0.0), ("lost", 0.7, Estimate(None), 1.0), ("noise", 0.1, right, 0.0)]
    figure = robustness_figure(rows)
    first, second = figure.axes[:2]
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["lost", "noise"]
    assert first.get_lines()[0].get_xdata().tolist() == [0.0]
    assert first.get_lines()[1].get_ydata().tolist() == [0.0, 1.0]
