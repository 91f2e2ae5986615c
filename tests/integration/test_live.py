"""From a simulated slide through the pixel camera and the tracker to the onset that a trained detector finds."""

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.detect.features import MotionSettings
from fingerslip.detect.live import latency_of, run_on_tracks
from fingerslip.detect.samples import Sampling
from fingerslip.detect.simulated import film_results, trial_cameras
from fingerslip.detect.training import detect, train
from fingerslip.detect.trials import Trial, write_trials
from fingerslip.history import phase_times, read_history
from fingerslip.marker_tracks import marker_tracks

pytestmark = pytest.mark.slow

STUDY = """
title: Slides of the section
tactip: {preset: tactip-ridged-2d}
mesh: {contact_size: 0.5 mm, bulk_size: 2 mm}
contact:
  boundary: contact
  friction: {static_kinetic: {static: 0.7, kinetic: 0.5, decay_speed: 1 mm/s}}
  normal_penalty: 5 GPa/m
  tangential_penalty: 5 GPa/m
programme:
  - press: {depth: 3 mm, speed: 3 mm/s}
  - hold: {duration: 2 s}
  - slide: {distance: 4.2 mm, speed: 0.3 mm/s}
time: {step: 100 ms, scheme: quasi_static}
record: {groups: [internal_markers, external_markers]}
sweep:
  contact.friction.static_kinetic.static: [0.6, 0.65, 0.7, 0.75]
"""
TESTED = "static-0.7"
MOTION = MotionSettings(rest_frames=100, window=11)
# Allowed frames between the onset in the film and the label, and the one in tracks of the point camera. It is 3 and 0.
OF_LABEL, OF_TRACKS = 10, 2
RATE = 67.0
# At this depth those of the touching markers are too close to gross slip to learn from four trials.
LABELS = "all_external_markers"


def by_rows(trial):
    """Return a trial with its markers numbered as the tracker numbers free ones in one row: along x."""
    tracks = trial.tracks
    inside = tracks["kind"].values == "internal"
    order = np.lexsort((tracks["position"].values[0, :, 0], ~inside))
    numbered = tracks.isel(marker=order).drop_vars(["ring", "angle"])
    return Trial(trial.name, numbered.assign_coords(marker=np.arange(order.size)), trial.labels, trial.conditions)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("film")
    (folder / "slides.yaml").write_text(STUDY)
    fs.run_study(folder / "slides.yaml", results_dir=folder / "results", workers=1)
    return folder / "results" / "slides"


@pytest.fixture(scope="module")
def trials(results):
    return write_trials(map(by_rows, film_results(results)), results.parent / "trials", "Slides of the section")


@pytest.fixture(scope="module")
def detector(trials):
    others = [name for name in trials.names if name != TESTED]
    sampling = Sampling(50, 50, 50, 50, least=0.5)
    return train(trials, trials.onsets(LABELS), "forest", motion=MOTION, sampling=sampling, names=others)


@pytest.fixture(scope="module")
def clip(results):
    """Film the inner markers of the slide that the detector did not learn from."""
    history = read_history(results / TESTED / "history.nc")
    tracks = marker_tracks(history, ("internal",))
    held = phase_times(history, "hold")[0][0]
    shown = tracks.isel(time=tracks["time"].values >= held - 1e-9)
    camera = fs.PixelCamera(trial_cameras().internal, fs.MarkerLook(radius=0.5e-3), seed=1)
    fs.film(camera, shown.assign_coords(time=shown["time"] - held), results / "clip.mkv")
    return results / "clip.mkv"


def test_the_onset_in_a_film_is_that_of_the_label(trials, detector, clip):
    label = trials.onsets(LABELS)[TESTED]
    _, _, known = detect(detector, trials.tracks(TESTED))
    tracks = fs.track_markers(clip, n_markers=9, rest_frames=MOTION.rest_frames, layout="free")
    findings = list(run_on_tracks(detector, tracks))
    found = findings[-1].onsets
    assert len(findings) == trials.tracks(TESTED).sizes["time"]
    assert found.incipient == pytest.approx(known.incipient, abs=OF_TRACKS / RATE)
    assert found.incipient == pytest.approx(label.incipient, abs=OF_LABEL / RATE)
    assert found.incipient < label.gross
    assert latency_of(findings).frames == len(findings)
