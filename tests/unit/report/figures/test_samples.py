"""Figures of samples and of pairs of runs."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.samples import Pair, indices_figure, paired_figure, tornado_figure
from fingerslip.results import RunResult
from fingerslip.sampling import fits_of
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import panels, words
from unit.report.tables.test_indices import one
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


@pytest.mark.parametrize(
    ("method", "keys", "axis"),
    [
        ("sobol", {"total", "first order"}, "Sobol index [-]"),
        ("morris", {"mean size", "standard deviation"}, "elementary effect [s]"),
    ],
)
def test_bars_are_the_numbers(method: str, keys: set[str], axis: str) -> None:
    figure = indices_figure([one(method)])
    (axes,) = panels(figure)
    assert [bar.get_width() for bar in axes.patches] == [0.3, 0.6, 0.2, 0.5]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["press depth", "friction coefficient"]
    assert keys <= words(figure)
    assert axes.get_xlabel() == axis


def test_groups_have_panels() -> None:
    groups = [one("sobol", group={"fingertip.phalanx.variant": name}) for name in ("original", "scaled")]
    titles = [axes.get_title(loc="left") for axes in panels(indices_figure(groups))]
    assert titles == ["phalanx original", "phalanx scaled"]


def test_each_pair_has_a_row_with_both_studies() -> None:
    slipped = RunResult("a", {}, Events(slip=SlipEvents(incipient=1.2, overall=1.7)))
    not_slipped = RunResult("a", {}, Events())
    pairs = (Pair("one", slipped, slipped), Pair("two", slipped, not_slipped))
    figure = paired_figure(pairs, ("A", "B"), ({"a": 1.0}, {"a": 1.1}))
    left, right = panels(figure)
    marks = [line for line in left.lines if line.get_marker() in "os"]
    assert [round(float(line.get_xdata()[0]), 3) for line in marks[:2]] == [0.7, 0.6]
    assert np.isnan(marks[3].get_xdata()[0])
    assert float(right.lines[1].get_xdata()[0]) == np.float64(500.0)
    assert [text.get_text() for text in left.get_yticklabels()] == ["one", "two"]
