"""The figure of a refinement."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.study import convergence_figure
from fingerslip.uncertainty import Convergence, Series

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
