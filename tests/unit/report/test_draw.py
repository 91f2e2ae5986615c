"""Figures by name, of a history at hand."""

import pytest

import fingerslip as fs
from unit.report.figures.made import EVENTS, HISTORY, marked, panels, titles
from unit.report.scenes import block_history


def test_a_history_is_drawn_by_name_with_its_events_or_those_that_are_given():
    events = fs.Events(slip=fs.SlipEvents(incipient=1.3))
    for known, expected in ((None, EVENTS.slip.incipient), (events, 1.3)):
        figure = fs.draw(HISTORY, "forces", events=known, title="mine")
        assert expected in marked(panels(figure)[0])
        assert figure.get_suptitle() == "Forces and slipping area: mine"
    frames = fs.draw(block_history(), "slip-frames", times=(0.05, 0.1), style="paper")
    assert [title[:7] for title in titles(frames)] == ["0.050 s", "0.100 s"]
    assert frames.get_figwidth() == 7.2
    with pytest.raises(fs.InputError, match="kind: got 'x', needs one of composed, deformed"):
        fs.draw(HISTORY, "x")
    with pytest.raises(fs.InputError, match="style: got 'x', needs one of page, paper, slides"):
        fs.draw(HISTORY, "forces", style="x")
    with pytest.raises(fs.ResultError, match="no receptors whose stimulus it resolves; write record"):
        fs.draw(HISTORY.drop_dims("site"), "spikes")
