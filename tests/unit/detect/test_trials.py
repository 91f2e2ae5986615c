"""Trials on disk, data sets of them, and one table of all frames."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from fingerslip.detect.features import MotionSettings
from fingerslip.detect.labels import CLASSES, Onsets, classes_at
from fingerslip.detect.samples import Sampling
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, synthetic_trial
from fingerslip.detect.training import detect, train
from fingerslip.detect.trials import (
    MANIFEST,
    Trial,
    check_labels,
    layout_digest,
    layout_text,
    open_trials,
    read_trial,
    write_parquet,
    write_trial,
    write_trials,
)
from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.marker_layouts import ring_layout
from fingerslip.storage.files import read_json, write_json
from fingerslip.vision.tracks import tracks_in_metres
from unit.vision.scenes import hide

SHORT = SyntheticSlide(travel=2e-3)


def test_a_data_set_is_opened_lazily_and_has_the_hash_of_its_files(trials, tmp_path):
    assert len(trials.names) == 24
    assert trials.conditions["slide-0000"]["indentation"] == 3e-3
    assert trials.trial("slide-0001").labels == trials.labels("slide-0001")
    assert trials.onsets()["slide-0002"].gross is not None
    card = (trials.folder / "README.md").read_text()
    assert "24 trials with 81 internal and 19 external markers in px; 260 to 260 frames each." in card
    assert "| indentation | 0.003, 0.004 |" in card
    with pytest.raises(InputError, match="has no labels 'mine', has external_markers, contact"):
        trials.onsets("mine")
    again = write_trials([synthetic_trial("a", SHORT)], tmp_path / "a", "A")
    assert write_trials([synthetic_trial("a", SHORT)], tmp_path / "b", "B").digest == again.digest != trials.digest


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("ab", "trial b: has 81 internal and 19 external markers in m, needs the unit of 81 internal"),
        ("aa", "trial a: stands twice"),
        ("", "trials: got none"),
    ],
)
def test_a_set_of_other_trials_is_refused_and_nothing_is_left(names, message, tmp_path):
    def trial(name):
        case = synthetic_trial(name, SHORT)
        return replace(case, tracks=tracks_in_metres(case.tracks)) if name == "b" else case

    with pytest.raises(InputError, match=message):
        write_trials(map(trial, names), tmp_path / "set", "Set")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_trials_of_different_layouts_have_none_and_teach_what_needs_none(tmp_path):
    sensors = [SyntheticSensor(), SyntheticSensor(internal=ring_layout(2.5e-3, (1, 8, 16)))]
    slides = [SyntheticSlide(travel=8e-3, seed=seed) for seed in range(4)]
    cases = [synthetic_trial(f"t{seed}", slide, sensors[seed % 2]) for seed, slide in enumerate(slides)]
    trials = write_trials(cases, tmp_path / "set", "Set")
    assert trials.layout == ""
    motion, sampling = MotionSettings(rest_frames=20, window=5), Sampling(20, 6, 6, 20, least=0.0)
    with pytest.raises(InputError, match="trial t1: has 50 features beside 162 of trial t0, needs the same markers"):
        train(trials, trials.onsets(), "forest", motion=motion, sampling=sampling)
    detector = train(trials, trials.onsets(), "forest:field", motion=motion, sampling=sampling)
    for name, case in zip(trials.names, cases, strict=True):
        onset = detect(detector, trials.tracks(name))[2].incipient
        assert onset == pytest.approx(case.labels["external_markers"].incipient, abs=1.0)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            lambda path: (path / "slide-0003/labels.csv").write_text(""),
            r"labels.csv.*is not the file of manifest\.json",
        ),
        (lambda path: (path / "slide-0003/labels.csv").unlink(), r"slide-0003/labels\.csv: cannot be read"),
        (lambda path: (path / "extra").mkdir(), r"extra.*is in the folder, not in manifest\.json"),
        (lambda path: (path / "slide-0005").rename(path.parent / "gone"), "slide-0005.*not in the folder"),
        (lambda path: write_json(path / MANIFEST, read_json(path / MANIFEST, "") | {"format": 9}), "format 9, not 1"),
        (lambda path: (path / MANIFEST).write_text("{}"), "checksum"),
    ],
)
def test_a_data_set_that_does_not_match_its_manifest_is_refused(damage, message, copied):
    folder = copied()
    damage(folder)
    with pytest.raises(ResultError if "cannot be read" in message else DamagedError, match=message):
        open_trials(folder)


def test_a_folder_without_a_manifest_and_a_label_that_never_comes_are_named(tmp_path):
    with pytest.raises(InputError, match=r"has no manifest.json, needs the folder of a data set"):
        open_trials(tmp_path)
    with pytest.raises(InputError, match="trial a: has no gross slip, needs both onsets here"):
        check_labels({"a": Onsets(1.0, None)}, ["a"])
    check_labels({"a": Onsets(1.0, None)}, ["a"], ("incipient",))
    check_labels({"a": Onsets(None, None)}, ["a"])
    with pytest.raises(InputError, match="labels: have no trial b"):
        check_labels({"a": Onsets(1.0, 2.0)}, ["a", "b"])


TRIAL = synthetic_trial("one", SyntheticSlide(travel=2e-3))


def test_a_trial_is_read_back_as_it_was_written_and_layouts_are_told_apart(tmp_path):
    folder = tmp_path / "one"
    folder.mkdir()
    write_trial(TRIAL, folder)
    found = read_trial(folder)
    assert set(found.labels) == {"external_markers", "contact"}
    assert found.tracks.equals(TRIAL.tracks)
    assert (found.name, found.labels, found.conditions) == ("one", TRIAL.labels, TRIAL.conditions)
    assert found.provenance["source"] == "analytic example, no sensor"
    (folder / "labels.csv").unlink()
    with pytest.raises(InputError, match=r"labels.csv: cannot be read"):
        read_trial(folder)
    tracks = TRIAL.tracks
    assert layout_text(tracks) == "81 internal and 19 external markers in px"
    assert layout_digest(tracks) == layout_digest(tracks.isel(time=slice(0, 3)))
    fewer = tracks.isel(marker=slice(1, None))
    others = tracks.assign_coords(ring=tracks["ring"] + 1)
    assert len({layout_digest(one) for one in (tracks, fewer, others)}) == 3


def test_a_name_is_that_of_a_folder_and_conditions_are_plain_values():
    for name in ("", "../up", "a/b", ".hidden", "a" * 101):
        with pytest.raises(InputError, match="trial: is named"):
            Trial(name, TRIAL.tracks, {})
    plain = {"surface": "acrylic", "wet": False, "task": "pour", "note": None, "speed": 3e-4}
    assert Trial("x", TRIAL.tracks, {}, plain).conditions == plain
    for wrong in ({"speed": "fast"}, {"speed": True}, {"mine": [1]}, {"mine": float("nan")}):
        with pytest.raises(InputError, match=r"trial x: .*: got"):
            Trial("x", TRIAL.tracks, {}, wrong)


def test_the_table_has_a_row_for_each_frame_and_nothing_for_what_was_not_seen(trials, tmp_path):
    write_parquet(replace(trials, names=trials.names[2:6]), tmp_path / "all.parquet")
    table = pd.read_parquet(tmp_path / "all.parquet")
    assert table["trial"].unique().tolist() == list(trials.names[2:6])
    one, tracks = table[table["trial"] == "slide-0004"], trials.tracks("slide-0004")
    assert np.array_equal(one["time_s"], tracks["time"].values)
    assert np.array_equal(one["external_0_x"], tracks["position"].values[:, 0, 0])
    classes = classes_at(trials.onsets()["slide-0004"], tracks["time"].values)
    assert one["class"].tolist() == np.array(CLASSES)[classes].tolist()
    assert set(one["condition_task"]) == {"slide"}
    assert one["condition_friction_coefficient"].iloc[0] == trials.conditions["slide-0004"]["friction_coefficient"]
    hidden = replace(TRIAL, tracks=hide(TRIAL.tracks, 3, 2))
    write_parquet(write_trials([hidden], tmp_path / "set", "One"), tmp_path / "a.parquet")
    assert pd.read_parquet(tmp_path / "a.parquet")["external_2_x"].isna().to_numpy().nonzero()[0].tolist() == [3]


def test_conditions_of_two_kinds_leave_no_file(tmp_path):
    made = [replace(TRIAL, name=name, conditions={"wet": value}) for name, value in (("a", True), ("b", "very"))]
    with pytest.raises(InputError, match="condition wet: mixes text and numbers"):
        write_parquet(write_trials(made, tmp_path / "set", "Two"), tmp_path / "a.parquet")
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
