"""Videos of analytic trials: what is tracked in them is what was filmed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.recordings import read_conditions, read_recording
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, film_trials, synthetic_trial
from fingerslip.marker_layouts import ring_layout

SENSOR = SyntheticSensor(
    internal=ring_layout(4e-3, (1, 6)), external=ring_layout(4e-3, (1, 6)), rest_frames=5, metres_per_pixel=120e-6
)


def test_a_trial_is_filmed_by_both_cameras(tmp_path: Path) -> None:
    trial = synthetic_trial("slide-0000", SyntheticSlide(direction=np.pi / 2, travel=1e-3), SENSOR)
    table = read_conditions(film_trials([trial], tmp_path / "films", size=(160, 120)))
    assert table == {
        "slide-0000.mkv": {
            "external": "slide-0000-outside.mkv",
            "indentation": pytest.approx(3e-3),
            "direction": pytest.approx(np.pi / 2),
        }
    }
    inside = trial.tracks.isel(marker=trial.tracks["kind"].values == "internal")
    found = read_recording(tmp_path / "films" / "slide-0000.mkv", 7, 5, "free")
    moved, known = (one["position"].values[-1] - one["position"].values[0] for one in (found, inside))
    # Numbers differ, and 0.05 px of noise are in what was filmed.
    assert np.sort(moved[:, 1]) == pytest.approx(np.sort(known[:, 1]), abs=0.1)
    outside = read_recording(tmp_path / "films" / "slide-0000-outside.mkv", 7, 5, "free")
    assert outside.sizes["time"] == trial.tracks.sizes["time"]
