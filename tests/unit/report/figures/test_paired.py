"""Two studies in one figure."""

from __future__ import annotations

import numpy as np

from fingerslip.report.figures.samples import Pair, paired_figure
from fingerslip.results import RunResult
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import panels


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
