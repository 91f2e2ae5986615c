from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.recordings import read_conditions, read_recording
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, film_trials, synthetic_slides, synthetic_trial
from fingerslip.marker_layouts import ring_layout


def test_slip_begins_at_the_rim_and_ends_in_the_centre() -> None:
    trial = synthetic_trial("a", SyntheticSlide(seed=3))
    label = trial.labels["external_markers"]
    assert label.incipient < label.gross
    external = trial.tracks.isel(marker=trial.tracks["kind"].values == "external")
    moved = np.linalg.norm(external["position"].values - external["position"].values[:20].mean(axis=0), axis=2)
    first = np.array([np.argmax(moved[:, marker] > 2.0) for marker in range(19)])
    ring = external["ring"].values
    assert first[ring == 2].mean() < first[ring == 1].mean() < first[ring == 0].mean()


def test_gross_slip_comes_again_and_again() -> None:
    trial = synthetic_trial("a", SyntheticSlide(seed=3, indentation=2e-3, travel=14e-3))
    centre = trial.tracks["position"].values[:, 0, 0]
    jumps = np.diff(centre) > 3.0
    assert jumps.sum() > 3


def test_a_short_slide_never_slips_and_the_seed_decides() -> None:
    held = synthetic_trial("a", SyntheticSlide(travel=0.4e-3))
    assert held.labels["external_markers"].first is None
    one, same, other = (synthetic_trial("a", SyntheticSlide(seed=seed, travel=2e-3)) for seed in (1, 1, 2))
    assert one.tracks.equals(same.tracks)
    assert not one.tracks.equals(other.tracks)


def test_later_slip_with_more_friction_and_depth() -> None:
    quiet = SyntheticSensor(noise=0.0)

    def gross(**slide: float) -> float:
        found = synthetic_trial("a", SyntheticSlide(**slide), quiet).labels["external_markers"].gross  # type: ignore[arg-type]
        assert found is not None
        return found

    assert gross(friction_coefficient=0.6) < gross(friction_coefficient=0.9)
    assert gross(indentation=2e-3) < gross(indentation=4e-3)


def test_the_protocol_has_320_trials() -> None:
    assert sum(1 for _ in synthetic_slides(travel=0.2e-3)) == 320


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
    search = {"n_markers": 7, "rest_frames": 5, "layout": "free"}
    found = read_recording(tmp_path / "films" / "slide-0000.mkv", search)
    moved, known = (one["position"].values[-1] - one["position"].values[0] for one in (found, inside))
    # Numbers differ, and 0.05 px of noise are in what was filmed.
    assert np.sort(moved[:, 1]) == pytest.approx(np.sort(known[:, 1]), abs=0.1)
    outside = read_recording(tmp_path / "films" / "slide-0000-outside.mkv", search)
    assert outside.sizes["time"] == trial.tracks.sizes["time"]
