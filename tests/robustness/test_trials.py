"""Wrong data sets, labels and detectors on the command line: one clear error each, and nothing half written."""

import json
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from fingerslip.commands.app import app
from fingerslip.detect.labels import Onsets, write_onsets
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.trials import Trial, write_trials
from fingerslip.storage.files import write_json
from fingerslip.vision.tracks import write_tracks

SETTINGS = ("--rest", "20", "--window", "5", "--samples", "20,6,2,20")
TRAIN = ("train", "slides", "--classifier", "time_threshold", "--output", "made", *SETTINGS)
FOREST = ("train", "slides", "--classifier", "forest", "--output", "made", *SETTINGS)
EVALUATE = ("evaluate", "slides", "--classifier", "time_threshold", "--output", "made", *SETTINGS)


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    """Return a folder with a data set of four trials and a detector."""
    folder = tmp_path_factory.mktemp("shipped")
    write_trials(synthetic_slides((3e-3,), directions=4, repeats=1, seed=1, travel=8e-3), folder / "slides", "Slides")
    made = [str(folder / part) if part in ("slides", "made") else part for part in TRAIN]
    assert CliRunner().invoke(app, ["detect", *made]).exit_code == 0
    (folder / "made").rename(folder / "detector")
    return folder


@pytest.fixture
def place(shipped, tmp_path, monkeypatch):
    """Return a copy of that folder, in which commands work."""
    shutil.copytree(shipped, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def changed(place, change):
    """Write the data set again, its first trial changed."""

    def trials():
        first, *others = synthetic_slides((3e-3,), directions=4, repeats=1, seed=1, travel=8e-3)
        yield from (change(first), *others)

    write_trials(trials(), place / "slides", "Slides")


def refused(place, arguments, *parts):
    """Check that a command gives one error with all of its parts, and leaves no file behind."""
    before = sorted(place.rglob("*"))
    found = CliRunner().invoke(app, ["detect", *arguments], env={"COLUMNS": "200"})
    assert found.exit_code == 2, found.output
    assert found.stderr.count("error:") == 1, found.stderr
    for part in parts:
        assert part in " ".join(found.stderr.split())
    assert sorted(place.rglob("*")) == before


@pytest.mark.slow
def test_trials_that_nothing_can_be_learned_from(place):
    changed(place, lambda trial: Trial(trial.name, trial.tracks.isel(marker=slice(0, 60)), trial.labels))
    fault = "trial slide-0001: has 162 features beside 82 of trial slide-0000", "needs the same markers and rings"
    refused(place, FOREST, *fault, "take features that need no layout, such as forest:field")
    changed(place, lambda trial: Trial(trial.name, trial.tracks, {"external_markers": Onsets(2.0, None)}))
    for arguments in (TRAIN, (*EVALUATE, "--folds", "2")):
        needed = "needs both onsets here", "leave the trial out, or slide it farther"
        refused(place, arguments, "trial slide-0000: has no gross slip", *needed)

    def never_seen(trial):
        tracks = trial.tracks.copy(deep=True)
        tracks["position"].values[:20, 40] = np.nan
        tracks["quality"].values[:20, 40] = 0.0
        return Trial(trial.name, tracks, trial.labels)

    changed(place, never_seen)
    needed = "needs a rest position of every marker", "leave the marker out"
    refused(place, TRAIN, "marker 40: is seen in none of the frames at rest", *needed)


def test_classes_that_are_missing_in_a_fold(place):
    # All slips at once, so that no frame is of incipient slip.
    write_onsets({f"slide-{number:04d}": Onsets(1.0, 1.0) for number in range(4)}, place / "labels.csv")
    arguments = (*EVALUATE, "--labels", "labels.csv", "--folds", "2", "--least", "0")
    refused(place, arguments, "has no frame of", "needs frames of all classes", "take more trials")


def test_a_model_for_other_features_and_one_for_other_markers(place):
    described = json.loads((place / "detector" / "detector.json").read_text())
    described.pop("checksum")
    write_json(place / "detector" / "detector.json", {**described, "features": ["time/seconds", "mean/displacement"]})
    run = ("run", "slides/slide-0000/tracks.nc", "--detector", "detector")
    refused(place, run, "sees 1 features and 3 classes, not 2 and 3", "train the detector again")
    (trial,) = synthetic_slides((3e-3,), directions=1, repeats=1, travel=2e-3)
    write_tracks(trial.tracks.isel(marker=slice(0, 60)), place / "few.nc")
    assert CliRunner().invoke(app, ["detect", *FOREST]).exit_code == 0
    needed = "needs the markers that the detector learned from", "train a detector"
    refused(
        place,
        ("run", "few.nc", "--detector", "made"),
        "tracks: have 41 internal markers (rings of 1, 8, 16 and 16) in px",
        *needed,
    )


def test_a_manifest_that_does_not_match(place):
    shutil.copy(place / "slides" / "slide-0001" / "labels.csv", place / "slides" / "slide-0000" / "labels.csv")
    for arguments in (TRAIN, EVALUATE, ("score", "slides", "none.csv")):
        fault = "is not the file of manifest.json", "write the data set again"
        refused(place, arguments, "slide-0000/labels.csv", *fault)


def test_folders_of_something_else_are_not_replaced(place):
    (place / "thesis").mkdir()
    (place / "thesis" / "chapter.tex").write_text("words")
    refused(
        place,
        (*TRAIN[:5], "thesis", *TRAIN[6:]),
        "thesis: holds files, but no detector.json",
        "needs a new folder, or one of the same kind to replace",
        "give another name",
    )
    (place / "table.csv").write_text("file\ntracks.nc\n")
    collect = ("collect", "slides/slide-0000", "table.csv", "--output", "thesis", "--rest", "20")
    refused(place, collect, "thesis: holds files, but no manifest.json")
