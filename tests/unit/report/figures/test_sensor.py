"""Figures of an optical sensor and its cameras."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.marker_tracks import filmed_tracks, marker_tracks
from fingerslip.report.figures.sensor import (
    film_times,
    frames_figure,
    marker_places_figure,
    onsets,
    slide_tracks_figure,
    slip_order_figure,
)
from fingerslip.vision.cameras.camera import true_tracks
from fingerslip.vision.cameras.presets import external_camera
from unit.filmed import NODES, filmed_history
from unit.report.figures.made import NO_SLIDE, panels, words
from unit.report.scenes import block_history
from unit.synthetic import Process, slip_times


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


def seen():
    camera = external_camera(30e-3, 14e-3, frame_rate=100.0, exposure=1e-3)
    return true_tracks(camera, filmed_tracks(filmed_history(), "external", 0.5))


def test_onsets_are_when_markers_leave_their_place_in_the_image():
    found, distance = onsets(seen(), 1.0)
    history = filmed_history()
    slip = slip_times(Process(), history["contact_position"].values[list(NODES), 0]) - 1.0
    # A pixel is 22 um, 7 ms of the plate, and a frame 10 ms.
    assert found == pytest.approx(slip, abs=0.04)
    assert found[0] == found.max()
    assert distance[0] == 0.0


def test_order_of_slip_leaves_out_what_does_not_touch():
    touching = np.array([True, True, True, True, False])
    moved, where = panels(slip_order_figure(seen(), 1.0, touching))
    assert len(moved.lines) == 4 + 1
    assert len(where.collections[0].get_offsets()) == 4
    nothing = slip_order_figure(seen(), 1.0, np.zeros(5, dtype=bool))
    assert "no marker touches" in panels(nothing)[0].texts[0].get_text()


@pytest.mark.slow
def test_frames_stand_above_the_body():
    times = film_times(0.05, 0.1, -0.4)
    assert times == pytest.approx((-0.4, 0.05, 0.05 + 0.05 / 3, 0.1))
    frame = np.zeros((12, 16), dtype=np.uint8)
    figure = frames_figure(block_history("Q4"), {times[0]: frame, times[1]: frame})
    titles = [axes.get_title(loc="left") for axes in panels(figure)]
    assert titles[:2] == ["frame at rest", "frame at 0.05 s"]
    assert titles[2].startswith("snapshot at 0.00 s")
