"""The tornado figure: bars over the ranges, the largest on top, the published time marked."""

from __future__ import annotations

import pytest

from fingerslip.report.figures.samples import tornado_figure
from fingerslip.sampling import fits_of
from unit.report.figures.made import panels, words
from unit.sampled import study_of


def overall_fits(*variants: str):  # type: ignore[no-untyped-def]
    return [fit for fit in fits_of(study_of(12, variants)) if fit.time == "overall"]


def test_bars_go_from_the_time_at_the_smallest_to_that_at_the_largest_value() -> None:
    (axes,) = panels(tornado_figure(overall_fits("original")))
    bars = [(bar.get_x(), bar.get_x() + bar.get_width(), bar.get_y() + 0.5 * bar.get_height()) for bar in axes.patches]
    smallest, largest = bars[2:5], bars[5:8]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert [label.partition(",")[0] for label in labels] == ["Poisson's ratio", "half height", "clearance"]
    assert labels[2] == "clearance, 0 to 0.4 mm"
    # Overall slip is at 1.8 s without clearance and at 1.6 s with 0.4 mm of it.
    assert smallest[2] == (pytest.approx(1.7), pytest.approx(1.8), pytest.approx(2.0))
    assert largest[2][1] == pytest.approx(1.6)


def test_panels_share_the_order_of_the_values_and_have_their_own_published_time() -> None:
    figure = tornado_figure(overall_fits("original", "scaled"), {0: (1.71, 1.71), 1: (1.75, 1.77)})
    first, second = panels(figure)
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["phalanx original", "phalanx scaled"]
    assert [line.get_xdata()[0] for line in first.lines if line.get_linestyle() == "--"] == [1.71]
    assert [line.get_xdata()[0] for line in second.lines if line.get_linestyle() == "--"] == [1.75, 1.77]
    assert {"published", "at the smallest value", "5 to 95 % of the samples"} <= words(figure)


def test_nothing_published_has_no_key() -> None:
    assert "published" not in words(tornado_figure(overall_fits("original")))
