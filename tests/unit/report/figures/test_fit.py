"""Figures of a fit: where the axes of the posterior end, what contours and bands hold, columns with their units."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.path import Path

from fingerslip.report.figures.fit import corner_figure, fit_figure
from fingerslip.report.figures.style import looking

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


def curves(*columns: tuple[str, str, float]) -> pd.DataFrame:
    """Return curves over three depths: the model has 1, 2, 3 times a scale, of which its bands are 0.1 and 0.2."""
    frames = []
    for name, unit, scale in columns:
        model, ones = scale * np.array([3.0, 1.0, 2.0]), scale * np.ones(3)
        bands = {"model 5 %": model - 0.1 * ones, "model 50 %": model, "model 95 %": model + 0.1 * ones}
        bands |= {"noisy 5 %": model - 0.2 * ones, "noisy 95 %": model + 0.2 * ones, "runs from": 0.0, "runs to": model}
        where = {"column": name, "unit": unit, "depth [m]": [2e-3, 0.0, 1e-3]}
        frames.append(pd.DataFrame({**where, "measured": model + 0.3 * ones, "deviation": 0.2 * ones, **bands}))
    return pd.concat(frames)


@pytest.mark.parametrize("count", [1, 2, 4, 5])
def test_each_column_has_its_unit_and_its_residuals(count: int) -> None:
    names = [("normal_force", "N", 1.0), *((f"m{number}.strain_xx", "", 1.0) for number in range(count - 1))]
    panels = [axes for axes in fit_figure(curves(*names)).axes if axes.get_visible()]
    labels = [axes.get_ylabel() for axes in panels]
    assert sorted(filter(None, labels)) == sorted([
        "normal force [N]", *["strain xx"] * (count - 1), *["residual [σ]"] * (1 if count < 4 else 2),
    ])  # fmt: skip
    assert len(panels) == 2 * count
    assert [axes.get_title(loc="left") for axes in panels if axes.get_ylabel() == "strain xx"] == [
        f"m{number}" for number in range(count - 1)
    ]
    columns = {1: 1, 2: 2, 4: 2, 5: 3}[count]
    assert [axes.get_xlabel() for axes in panels].count("depth [mm]") == columns
    with looking("column"):
        narrow = [axes for axes in fit_figure(curves(*names)).axes if axes.get_visible()]
    assert [axes.get_xlabel() for axes in narrow].count("depth [mm]") == min(columns, 2)


def test_a_curve_and_its_bands_are_drawn_in_order_and_its_residuals_in_deviations() -> None:
    above, below = fit_figure(curves(("m1.stress_xx", "Pa", 1e3))).axes
    for axes, first, sizes in ((above, 1.0, (0.4, 0.2)), (below, 0.0, (2.0, 1.0))):
        for band, size in zip(axes.collections[axes is above :], sizes, strict=False):
            heights = band.get_paths()[0].vertices
            at_first = heights[np.isclose(heights[:, 0], 0.0), 1]
            assert (at_first.min(), at_first.max()) == pytest.approx((first - 0.5 * size, first + 0.5 * size))
        assert axes.lines[0].get_xdata() == pytest.approx([0.0, 1.0, 2.0]), "in mm"
    assert above.lines[0].get_ydata() == pytest.approx([1.0, 2.0, 3.0]), "median, in kPa"
    assert above.lines[1].get_ydata() == pytest.approx([1.3, 2.3, 3.3]), "measured"
    assert below.lines[1].get_ydata() == pytest.approx([1.5] * 3), "0.3 over 0.2"
    for axes, size in ((above, 0.4), (below, 2.0)):
        bars = axes.collections[-1].get_segments()
        assert np.ptp(np.array(bars)[:, :, 1], axis=1) == pytest.approx(size), "two deviations"
