"""Figures of markers of a sensor."""

from __future__ import annotations

import pytest

from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.figures.sensor import marker_places_figure, slide_tracks_figure
from unit.filmed import filmed_history
from unit.report.figures.made import NO_SLIDE, panels, words


def test_markers_at_rest_stand_in_a_panel_for_each_kind():
    figure = marker_places_figure(marker_tracks(filmed_history()), "a run")
    assert [axes.get_title(loc="left") for axes in panels(figure)] == [
        "1 internal markers, from inside",
        "5 external markers, from below",
    ]
    assert {"centre", "ring 1", "ring 2", "Markers at rest: a run"} <= words(figure)


def test_markers_follow_the_plate_until_they_slip():
    history = filmed_history()
    figure = slide_tracks_figure(marker_tracks(history), history)
    external = panels(figure)[1]
    ends = [float(line.get_ydata()[-1]) for line in external.lines[:5]]
    # The centre is drawn last and slips last.
    assert ends[-1] == pytest.approx(max(ends))
    assert external.get_title(loc="left") == "external markers"


def test_without_a_slide_there_is_nothing_to_draw():
    with pytest.raises(ValueError, match="has no slide"):
        slide_tracks_figure(marker_tracks(filmed_history()), NO_SLIDE)
