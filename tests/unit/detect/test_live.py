from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from fingerslip.detect.evaluation.inquiries import disturb
from fingerslip.detect.live import Frame, LiveDetector, frames_of, latency_of, run_live, run_on_markers, run_on_tracks
from fingerslip.detect.training import Detector, detect
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError
from fingerslip.vision.tracking.track import SeenMarkers


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
    assert latency_of(found).median > 0


def test_nothing_is_found_before_rest_is_over(detector: Detector, trials: TrialSet) -> None:
    live, frames = LiveDetector(detector), list(frames_of(trials.tracks(trials.names[-1])))
    assert [len(live.take(frame)) for frame in frames[:22]] == [*[0] * 19, 20, 1, 1]
    with pytest.raises(InputError, match="fewer than the frames at rest"):
        latency_of(list(run_live(detector, frames[:5])))


def test_frames_that_do_not_follow_are_refused(detector: Detector, trials: TrialSet) -> None:
    frames = list(frames_of(trials.tracks(trials.names[-1])))
    for start in (3, 25):
        live = LiveDetector(detector)
        for frame in frames[:start]:
            live.take(frame)
        with pytest.raises(InputError, match="needs rising times"):
            live.take(frames[start - 1])
        with pytest.raises(InputError, match=r"frame: has positions of shape \(4, 2\)"):
            live.take(Frame(1e3, np.zeros((4, 2))))


def test_a_marker_that_is_never_seen_at_rest_is_named(detector: Detector, trials: TrialSet) -> None:
    tracks = trials.tracks(trials.names[-1])
    tracks["position"].values[:20, 30] = np.nan
    tracks["quality"].values[:20, 30] = 0.0
    with pytest.raises(InputError, match="marker 11: is seen in none of the frames at rest"):
        list(run_on_tracks(detector, tracks))


def test_other_markers_are_refused(detector: Detector, trials: TrialSet) -> None:
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        list(run_on_tracks(detector, trials.tracks(trials.names[0]).isel(marker=slice(0, 50))))


@dataclass(frozen=True)
class Streamed:
    """Tracks as a tracker gives them, frame by frame."""

    tracks: xr.Dataset

    @property
    def at_rest(self) -> xr.Dataset:
        return self.tracks.isel(time=slice(0, 1))

    @property
    def reference(self) -> SimpleNamespace:
        return SimpleNamespace(ring=self.tracks["ring"].values)

    def __iter__(self) -> Iterator[SeenMarkers]:
        for time, position, quality in zip(
            self.tracks["time"].values, self.tracks["position"].values, self.tracks["quality"].values, strict=True
        ):
            yield SeenMarkers(float(time), position.astype(np.float32), quality.astype(np.float32), 0)


def test_markers_of_a_video_are_detected_on_as_tracks_are(detector: Detector, trials: TrialSet) -> None:
    tracks = trials.tracks(trials.names[-1])
    inside = tracks.isel(marker=tracks["kind"].values == "internal")
    found, known = list(run_on_markers(detector, Streamed(inside))), list(run_on_tracks(detector, inside))  # type: ignore[arg-type]
    assert [one.slip for one in found] == pytest.approx([one.slip for one in known], abs=1e-3)
    assert found[-1].onsets == known[-1].onsets
    assert latency_of(found).frames == len(known)
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        list(run_on_markers(detector, Streamed(inside.isel(marker=slice(0, 5)))))  # type: ignore[arg-type]
