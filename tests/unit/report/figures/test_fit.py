"""Figures of a fit: where the axes of the posterior end, what contours hold, and columns with their units."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path

from fingerslip.report.figures.fit import corner_figure, fit_figure
from fingerslip.sampling.curves import Measurement

GENERATOR = np.random.default_rng(1)


def test_axes_end_with_the_posterior_or_the_prior_and_contours_hold_their_share() -> None:
    samples = GENERATOR.standard_normal((4000, 3)) * [0.5, 30.0, 0.3] + [40.0, 100.0, 0.0]
    samples[:, 1:] = np.abs(samples[:, 1:])
    ends = np.array([20.0, 60.0]), np.array([60.0, 110.0])
    samples = samples[(samples[:, 1] > 60.0) & (samples[:, 1] < 110.0)]
    figure = corner_figure(samples, ["tissue", "skin", "discrepancy"], ["kPa", "kPa", ""], ends)
    limits = [figure.axes[6 + column].get_xlim() for column in range(3)]
    assert 37.0 < limits[0][0] < samples[:, 0].min() + 0.5
    assert 43.0 > limits[0][1] > samples[:, 0].max() - 0.5
    assert limits[1] == (60.0, 110.0)
    assert limits[2][0] == 0.0
    assert figure.axes[6].get_xlabel() == "tissue\n[kPa]"
    # Densities over the whole range, wherever the axis ends.
    assert figure.axes[0].lines[-1].get_ydata()[0] == pytest.approx(1.0 / 40.0)
    assert max(bar.get_height() for bar in figure.axes[0].patches) == pytest.approx(0.8, rel=0.15)
    pair = figure.axes[3]
    for collection, share in zip(pair.collections, (0.95, 0.68), strict=True):
        (outline,) = (path for path in collection.get_paths() if len(path.vertices))
        assert isinstance(outline, Path)
        assert outline.contains_points(samples[:, :2]).mean() == pytest.approx(share, abs=0.05)


def test_columns_have_their_units_and_of_many_the_first_are_drawn() -> None:
    names = ("normal_force", *(f"m{number}.strain_xx" for number in range(7)))
    positions = np.array([2e-3, 0.0, 1e-3])
    measurement = Measurement("depth", positions, names, np.ones((8, 3)), np.full((8, 1), 0.1))
    curves = np.ones((5, 8, 3)) + 0.1 * GENERATOR.standard_normal((5, 8, 3))
    panels = [axes for axes in fit_figure(measurement, curves, curves, curves).axes if axes.get_visible()]
    assert [axes.get_ylabel() for axes in panels] == [
        "normal force [N]", *(f"m{number}.strain xx" for number in range(5)),
    ]  # fmt: skip
    assert panels[-1].get_xlabel() == "depth [mm]"
    assert panels[0].lines[0].get_xdata() == pytest.approx([0.0, 1.0, 2.0])


def test_bands_hold_95_percent_of_the_model_and_of_what_it_predicts() -> None:
    positions, values = np.array([2e-3, 0.0, 1e-3]), np.array([[3e3, 1e3, 2e3]])
    measurement = Measurement("depth", positions, ("m1.stress_xx",), values, np.array([[500.0]]))
    spread = np.linspace(-1e3, 1e3, 201)[:, None, None]
    (axes,) = fit_figure(measurement, values[None], values + spread, values + 1e3 + 2.0 * spread).axes
    ends = []
    for band in axes.collections[:2]:
        heights = band.get_paths()[0].vertices
        at_first = heights[np.isclose(heights[:, 0], 0.0), 1]
        ends.append((at_first.min(), at_first.max()))
    assert ends == [pytest.approx((0.1, 3.9)), pytest.approx((0.05, 1.95))], "in kPa"
    assert axes.lines[1].get_ydata() == pytest.approx([1.0, 2.0, 3.0]), "median of the model"
    assert axes.lines[2].get_ydata() == pytest.approx([1.0, 2.0, 3.0]), "measured"
    bars = axes.collections[2].get_segments()
    assert np.ptp(np.array(bars)[:, :, 1], axis=1) == pytest.approx(1.0), "two deviations"
