"""A detector that learned from markers, in the loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pytest

from fingerslip.detect.features import FeatureSettings, MotionSettings, markers_of, motion_of
from fingerslip.detect.live import run_on_tracks
from fingerslip.detect.training import Detector
from fingerslip.detect.trials import layout_digest, layout_text
from fingerslip.errors import InputError
from fingerslip.marker_tracks import marker_tracks
from fingerslip.model.model import Model, Recording
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.markers import LearnedMarkers
from fingerslip.react.scenario import HeldObject
from fingerslip.sites import Site
from unit.pads import pad

HELD = HeldObject(load=RampLoad(rate=8.0, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.1, step=2e-3)
REST = 10
FRAME_RATE = 250.0


@dataclass(frozen=True)
class Threshold:
    """Says slip, and gross slip, where a marker moved farther than two distances [m]."""

    slip: float
    gross: float

    def predict_proba(self, values: np.ndarray) -> np.ndarray:
        largest = np.abs(values).max(axis=1)
        slips, is_gross = largest >= self.slip, largest >= self.gross
        return np.stack([~slips, slips & ~is_gross, is_gross], axis=1).astype(float)


class AsItIs:
    """Scores of single frames."""

    def start(self) -> np.ndarray:
        return np.zeros(0)

    def scores(self, state: np.ndarray, interval: np.ndarray, chances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # noqa: ARG002
        return np.stack([0.5 - chances[:, 0], chances[:, 2] - 0.5], axis=1), state


def holder() -> Model:
    sites = tuple(Site(f"internal-marker-0-{n:02d}", "internal marker", (1e-3 * (n - 2), 1e-3)) for n in range(5))
    return replace(pad(), record=Recording(sites=sites))


@pytest.fixture(scope="module")
def detector() -> Detector:
    """Return a detector for which slip begins before the load does, gross slip after it."""
    with Grasp(HELD, holder(), {}) as grasp:
        inside = markers_of(marker_tracks(grasp.history(None)), "internal")
    motion = MotionSettings(rest_frames=REST, window=3)
    moved = motion_of(inside.isel(time=slice(0, None, 2)), motion).displacement
    largest = np.linalg.norm(moved, axis=2).max(axis=1)
    begins = round(0.5 * HELD.begins / HELD.step)
    threshold = Threshold(0.5 * largest[begins], 0.5 * (largest[begins] + largest[-1]))
    layout = layout_digest(inside), layout_text(inside)
    return Detector("threshold", threshold, FeatureSettings(("displacement",), motion), (), *layout, AsItIs())


@pytest.mark.parametrize("event", ["incipient", "gross"])
def test_alarm_is_the_onset_that_the_detector_finds_in_the_whole_tracks(
    detector: Detector, event: Literal["incipient", "gross"]
) -> None:
    with Grasp(HELD, holder(), {"learned": LearnedMarkers(detector, FRAME_RATE, event)}) as grasp:
        alarm = grasp.open_loop.alarms["learned"]
        tracks = marker_tracks(grasp.history(None)).isel(time=slice(0, None, 2))
    onset = getattr(list(run_on_tracks(detector, tracks))[-1].onsets, event)
    assert alarm is not None
    assert onset is not None
    # The skin shears as weight and grip come: that onset lies before the load.
    assert alarm.time == pytest.approx(max(onset - HELD.begins, 0.0), abs=1e-9)
    assert (alarm.time == 0.0) == (event == "incipient")


def test_detector_of_other_markers_is_refused(detector: Detector) -> None:
    other = replace(detector, layout="other")
    with Grasp(HELD, holder(), {"learned": LearnedMarkers(other)}) as grasp, pytest.raises(InputError, match="have "):
        assert grasp.open_loop


def test_holder_without_markers_is_refused(detector: Detector) -> None:
    with pytest.raises(InputError) as caught:
        Grasp(HELD, pad(), {"learned": LearnedMarkers(detector)})
    assert str(caught.value) == (
        "detectors.learned: needs sites of the kind internal_markers, the holder has none; "
        "write holder_of(..., groups=['internal_markers']), or record.sites in a study"
    )
