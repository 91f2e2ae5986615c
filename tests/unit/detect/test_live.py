from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.evaluation.inquiries import disturb
from fingerslip.detect.live import LiveDetector, frames_of, latency_of, run_live, run_on_tracks
from fingerslip.detect.training import Detector, detect
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError
from fingerslip.vision.tracking.tracker import SeenMarkers


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_frame_by_frame_finds_what_whole_tracks_give(detector: Detector, trials: TrialSet, lost: float) -> None:
    tracks = disturb(trials.tracks(trials.names[-1]), "lost", lost, seed=3)
    tracks["position"].values[100] = np.nan
    tracks["quality"].values[100] = 0.0
    time, scores, onsets = detect(detector, tracks)
    found = list(run_on_tracks(detector, tracks))
    assert [one.time for one in found] == time.tolist()
    assert np.array([[one.slip, one.gross] for one in found]) == pytest.approx(scores, abs=1e-4)
    assert found[-1].onsets == onsets
    assert latency_of(found).frames == len(time)
    latency = latency_of(found)
    assert 0 < latency.median <= latency.late <= latency.largest


def test_nothing_is_found_before_rest_is_over(detector: Detector, trials: TrialSet) -> None:
    live, frames = LiveDetector(detector), list(frames_of(trials.tracks(trials.names[-1])))
    assert [len(live.take(frame)) for frame in frames[:22]] == [*[0] * 19, 20, 1, 1]
    with pytest.raises(InputError, match="fewer than the frames at rest"):
        latency_of(list(run_live(LiveDetector(detector), frames[:5])))


def test_what_does_not_fit_the_detector_is_refused(detector: Detector, trials: TrialSet) -> None:
    frames = list(frames_of(trials.tracks(trials.names[-1])))
    for start in (3, 25):
        live = LiveDetector(detector)
        for frame in frames[:start]:
            live.take(frame)
        with pytest.raises(InputError, match="frame: is a list, needs the markers of one frame; write: for seen in"):
            live.take([])  # type: ignore[arg-type]
        with pytest.raises(InputError, match="needs rising times"):
            live.take(frames[start - 1])
        with pytest.raises(InputError, match=r"frame: has positions of shape \(4, 2\)"):
            live.take(SeenMarkers(1e3, np.zeros((4, 2))))
    tracks = trials.tracks(trials.names[-1])
    tracks["position"].values[:20, 30] = np.nan
    tracks["quality"].values[:20, 30] = 0.0
    with pytest.raises(InputError, match="marker 11: is seen in none of the frames at rest"):
        list(run_on_tracks(detector, tracks))
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        list(run_on_tracks(detector, trials.tracks(trials.names[0]).isel(marker=slice(0, 50))))
