"""Trials on disk, data sets of them, and one table of all frames."""

import errno
import inspect
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from fingerslip.commands import detect as commands
from fingerslip.detect.features import MotionSettings
from fingerslip.detect.labels import CLASSES, Onsets, classes_at, read_onsets
from fingerslip.detect.recordings import (
    read_any_tracks,
    read_conditions,
    read_recording,
    recorded_trials,
    with_external,
)
from fingerslip.detect.samples import Sampling
from fingerslip.detect.session import collect_trials
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
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.storage.files import read_json, write_json
from fingerslip.vision.tracking.track import track_markers
from fingerslip.vision.tracks import make_tracks, tracks_in_metres, write_tracks, write_tracks_csv
from fingerslip.vision.video import write_video
from unit.vision.scenes import hide

SHORT = SyntheticSlide(travel=2e-3)
TRIAL = synthetic_trial("a", SHORT)


def test_a_data_set_is_opened_lazily_and_has_the_hash_of_its_files(trials, tmp_path):
    assert len(trials.names) == 24
    assert trials.conditions["slide-0000"]["indentation"] == 3e-3
    assert trials.trial("slide-0001").labels == trials.labels("slide-0001")
    assert trials.onsets()["slide-0002"].gross is not None
    card = (trials.folder / "README.md").read_text()
    assert "24 trials with 81 internal and 19 external markers (rings of 1, " in card
    assert " in px; 260 to 260 frames each." in card
    assert "| indentation | 0.003, 0.004 |" in card
    with pytest.raises(InputError, match="has no labels 'mine', has external_markers, contact; write --labels contact"):
        trials.onsets("mine")
    again = write_trials([synthetic_trial("a", SHORT)], tmp_path / "a", "A")
    assert write_trials([synthetic_trial("a", SHORT)], tmp_path / "b", "B").digest == again.digest != trials.digest


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("ab", "markers .rings of 1, 8, 16, 24 and 32. in m, needs the unit of 81 internal"),
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
    assert read_json(trials.folder / "manifest.json", "")["layout"] == ""
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
    assert layout_text(tracks) == "81 internal and 19 external markers (rings of 1, 8, 16, 24 and 32) in px"
    assert layout_text(tracks.drop_vars("ring")) == "81 internal and 19 external markers (no rings) in px"
    no_ring = tracks.assign_coords(ring=0 * tracks["ring"] - 1)
    assert layout_text(no_ring) == "81 internal and 19 external markers (no rings) in px"
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


@pytest.mark.parametrize("values", [(True, "very"), (1.5, True), (True, 1.5), (1, "1")])
def test_conditions_of_two_kinds_leave_no_file(tmp_path, values):
    made = [replace(TRIAL, name=name, conditions={"wet": value}) for name, value in zip("ab", values, strict=True)]
    with pytest.raises(InputError, match="condition wet: mixes kinds, needs one kind in all trials"):
        write_parquet(write_trials(made, tmp_path / "set", "Two"), tmp_path / "a.parquet")
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_full_disk_is_told_where_trials_are_put_together(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    write_trial(TRIAL, tmp_path / "a")

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.link", full)
    monkeypatch.setattr("shutil.copy2", full)
    with pytest.raises(ResultError, match=r"No space left on device.*; free some space"):
        write_trials([tmp_path / "a"], tmp_path / "set", "One")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize(
    "text",
    ["source,incipient_s\nx,1.0\n", "source,incipient_s,gross_s\nx,1.0\n", "source,incipient_s,gross_s\nx,1,2,3\n"],
)
def test_labels_of_a_trial_that_were_cut_are_refused(tmp_path, text):
    (tmp_path / "labels.csv").write_text(text)
    with pytest.raises(InputError, match=r"labels.csv.*needs"):
        read_onsets(tmp_path / "labels.csv", "source")


@pytest.fixture
def folder(tmp_path):
    write_tracks(TRIAL.tracks, tmp_path / "first.nc")
    write_tracks_csv(TRIAL.tracks, tmp_path / "second.csv")
    table = "file,indentation [mm],direction [deg],surface,repeat\nfirst.nc,3,90,acrylic,1\nsecond.csv,4,,acrylic,2\n"
    (tmp_path / "conditions.csv").write_text(table)
    return tmp_path


def test_recordings_become_a_data_set(folder):
    own = {"second": Onsets(1.0, None)}
    made = recorded_trials(folder, folder / "conditions.csv", own, tracking={"rest_frames": 20})
    trials = write_trials(made, folder / "set", "Recordings")
    assert trials.names == ("first", "second")
    conditions = dict(trials.conditions["first"])
    assert conditions.pop("surface") == "acrylic"
    assert conditions == pytest.approx({"indentation": 3e-3, "direction": np.pi / 2, "repeat": 1.0})
    assert "direction" not in trials.conditions["second"]
    assert trials.labels("first") == {"external_markers": TRIAL.labels["external_markers"]}
    assert trials.labels("second")["user"] == Onsets(1.0, None)
    assert trials.trial("second").provenance == {"recording": "second.csv"}


def test_missing_recordings_and_labels_are_named(folder):
    assert read_any_tracks(folder / "first.nc").equals(TRIAL.tracks)
    with pytest.raises(InputError, match=r"none.csv: cannot be read \(.*\), needs a CSV file"):
        read_conditions(folder / "none.csv")
    (folder / "more.csv").write_text("file\nthird.nc\n")
    with pytest.raises(InputError, match=r"names third\.nc, needs files that are in"):
        list(recorded_trials(folder, folder / "more.csv"))
    write_tracks(TRIAL.tracks.isel(marker=TRIAL.tracks["kind"].values == "internal"), folder / "first.nc")
    labels = {"first.nc": Onsets(1.0, None), "second": Onsets(1.0, None)}
    with pytest.raises(InputError, match=r"first: has nothing to label it by, .*; labels name first.nc, as no trial"):
        list(recorded_trials(folder, folder / "conditions.csv", labels))
    (folder / "more.csv").write_text("file\nsecond.csv\n")
    with pytest.raises(InputError, match=r"labels: second: has slip at 1200 s, after its end at .* s"):
        list(recorded_trials(folder, folder / "more.csv", {"second": Onsets(1200.0, None)}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name\na\n", "a row has no file, needs a column 'file'"),
        ("file\na\na\n", "'a' stands twice"),
        ("file\n", "has no rows"),
        (
            "file,indentation\na,3.5\n",
            r"line 2: indentation: '3.5' has no unit, .*\[m\]; write it in the first line, as in indentation \[mm\]$",
        ),
        ("file,indentation\na,deep\n", "'deep' is not a quantity"),
        ("file,indentation [s]\na,3\n", r"line 2: indentation"),
        ("file,surface [mm]\na,3\n", "has the unit mm, takes none; units are known of indentation"),
        ("file,x\na,1,2\n", "more cells than there are names"),
        ("file,[mm]\na,1\n", r"has the column '\[mm\]'"),
    ],
)
def test_bad_tables_give_one_clear_error(text, message, tmp_path):
    (tmp_path / "c.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_conditions(tmp_path / "c.csv")


REST, RATE = 10, 30.0
INNER = [(40.0, 30.0), (80.0, 30.0), (120.0, 30.0), (60.0, 60.0), (100.0, 60.0), (80.0, 90.0)]
OUTER = [(80.0, 60.0), (50.0, 30.0), (110.0, 30.0), (50.0, 90.0), (110.0, 90.0)]


def film(path, places, moves, frames=40):
    """Write a video of dark markers; those in `moves` go along x from a frame on, a pixel a frame."""
    rows, columns = np.mgrid[:120, :160]
    noise, made = np.random.default_rng(0), []
    for number in range(frames):
        frame = noise.normal(180.0, 2.0, rows.shape)
        for marker, (x, y) in enumerate(places):
            gone = max(number - moves.get(marker, frames), 0)
            frame[np.hypot(columns - x - gone, rows - y) < 5] = 40
        made.append(frame.astype(np.uint8))
    write_video(path, iter(made), RATE)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Return a folder of two trials by two cameras: outer markers move from frame 14 on, the central one from 24 on."""
    folder = tmp_path_factory.mktemp("recordings")
    for name in ("one", "two"):
        film(folder / f"{name}.mkv", INNER, dict.fromkeys(range(6), REST))
        film(folder / f"{name}-outside.mkv", OUTER, {0: 24, 1: 14, 2: 14, 3: 14, 4: 14})
    table = "file,external,indentation [mm]\none.mkv,one-outside.mkv,3\ntwo.mkv,two-outside.mkv,4\n"
    (folder / "conditions.csv").write_text(table)
    return folder


def search(n_markers: int, **more) -> dict:
    """Return how the inner markers are tracked."""
    return {"tracking": {"n_markers": n_markers, "layout": "free", "rest_frames": REST, **more}}


@pytest.fixture
def collect(recordings, tmp_path):
    """Return a function that makes a data set of some of the recordings."""

    def made(**more):
        options = {"labels": None, "title": "Recorded"} | search(6) | {"external_markers": 5}
        return collect_trials(recordings, recordings / "conditions.csv", tmp_path / "trials", **{**options, **more})

    return made


@pytest.mark.slow
def test_videos_of_both_cameras_become_a_data_set_with_the_labels_of_their_user(collect, tmp_path):
    (tmp_path / "mine.csv").write_text("trial,incipient_s,gross_s\none,0.5,0.9\ntwo,0.6,\n")
    assert collect(labels=tmp_path / "mine.csv") == f"{tmp_path / 'trials'}: 2 trials"
    trials = open_trials(tmp_path / "trials")
    assert trials.onsets("user") == {"one": Onsets(0.5, 0.9), "two": Onsets(0.6, None)}
    assert set(trials.labels("two")) == {"user", "external_markers"}
    found = trials.trial("one")
    assert found.tracks["kind"].values.tolist() == ["internal"] * 6 + ["external"] * 5
    # More than 2 px beside the central marker, and more than 1 px of it.
    label = found.labels["external_markers"]
    assert label.incipient == pytest.approx(16.5 / RATE, abs=0.6 / RATE)
    assert label.gross == pytest.approx(25.5 / RATE, abs=0.6 / RATE)
    assert found.conditions == {"indentation": pytest.approx(3e-3)}
    assert found.provenance == {"recording": "one.mkv", "external_recording": "one-outside.mkv"}
    moved = found.tracks["position"].values[:, :6]
    assert moved[-1] - moved[0] == pytest.approx(np.tile([29.0, 0.0], (6, 1)), abs=0.3)


def test_the_layout_is_found_by_itself(tmp_path):
    places = np.array([80.0, 60.0]) + hexagonal_layout(20.0, 2).position
    film(tmp_path / "hexagon.mkv", list(map(tuple, places)), {}, frames=REST + 2)
    (tmp_path / "table.csv").write_text("file\nhexagon.mkv\n")
    (tmp_path / "mine.csv").write_text("trial,incipient_s,gross_s\nhexagon,0.2,0.3\n")
    target = tmp_path / "trials"
    options = {"labels": tmp_path / "mine.csv", "title": "", "tracking": {"rest_frames": REST}}
    collect_trials(tmp_path, tmp_path / "table.csv", target, **options)
    assert np.bincount(open_trials(target).tracks("hexagon")["ring"].values).tolist() == [1, 6, 12]
    for function in (track_markers, commands.collect, commands.run):
        assert inspect.signature(function).parameters["layout"].default == "auto"


@pytest.mark.slow
def test_what_is_wrong_with_a_video_is_said_and_kept(recordings, tmp_path):
    film(recordings / "early.mkv", INNER, dict.fromkeys(range(6), 3))
    (tmp_path / "table.csv").write_text("file\nearly.mkv\n")
    (tmp_path / "mine.csv").write_text("trial,incipient_s,gross_s\nearly,0.5,0.9\n")
    options = {"labels": tmp_path / "mine.csv", "title": "", **search(6)}
    said = collect_trials(recordings, tmp_path / "table.csv", tmp_path / "trials", **options)
    assert "early: " in said
    assert "the sensor moved by" in said
    assert "the reference is no rest" in open_trials(tmp_path / "trials").trial("early").provenance["warnings"]


def test_rest_is_found_and_a_data_set_that_is_replaced_is_told(recordings, tmp_path):
    """Outer markers rest as long as the inner ones: of the 40 frames of all are no rest."""
    table = recordings / "conditions.csv"
    options = {"labels": None, "title": "", "external_markers": 5}
    target = tmp_path / "trials"
    assert collect_trials(recordings, table, target, **options, **search(6, rest_frames=None)) == f"{target}: 2 trials"
    label = open_trials(target).labels("one")["external_markers"]
    assert label.incipient == pytest.approx(16.5 / RATE, abs=0.6 / RATE)
    again = f"{target}: 2 trials, in the place of those that were there"
    assert collect_trials(recordings, table, target, **options, **search(6)) == again
    assert open_trials(target).labels("one")["external_markers"].incipient == pytest.approx(label.incipient)


@pytest.mark.slow
def test_options_of_the_tracker_reach_both_cameras_and_files_of_tracks_are_read_as_they_are(collect, tmp_path):
    """Twice the frame rate is half the time, in both; a mask that leaves nothing is for the inner one alone."""
    nothing = np.zeros((120, 160), dtype=bool)
    nothing[:3, :3] = True
    for options, message in ((search(40), "needs 40"), (search(6, mask=nothing), "found no markers")):
        with pytest.raises(InputError, match=rf"one\.mkv: .*{message}"):
            collect(**options)
    assert not (tmp_path / "trials").exists()
    collect(**search(6, frame_rate=2 * RATE, channel="red"))
    assert open_trials(tmp_path / "trials").tracks("one").attrs["frame_rate"] == 2 * RATE
    tracks = make_tracks(np.zeros((3, 2, 2)), np.arange(3) / RATE, units="px")
    write_tracks(tracks, tmp_path / "tracks.nc")
    assert read_recording(tmp_path / "tracks.nc", {"n_markers": 81}).equals(tracks)


def test_a_column_says_which_recordings_have_no_slip(recordings, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("file,slip\none.mkv,no\ntwo.mkv,yes\n")
    collect_trials(recordings, table, tmp_path / "trials", labels=None, title="", **search(6))
    trials = open_trials(tmp_path / "trials")
    assert trials.labels("one") == {"user": Onsets(None, None)}
    assert trials.labels("two") == {}
    assert [trials.conditions[name]["slip"] for name in ("one", "two")] == ["no", "yes"]
    table.write_text("file,slip\none.mkv,perhaps\n")
    with pytest.raises(InputError, match="slip: got 'perhaps', needs yes or no"):
        read_conditions(table)


def test_recordings_of_two_cameras_have_to_fit(recordings, tmp_path):
    inner = make_tracks(np.zeros((31, 2, 2)), np.arange(31) / RATE, units="px")
    with pytest.raises(InputError, match=r"external: lasts 0\.5 s beside 1 s, needs two recordings that begin and end"):
        with_external(inner, inner.isel(time=slice(0, 16)))
    metres = make_tracks(np.zeros((31, 2, 2)), np.arange(31) / RATE, units="m")
    with pytest.raises(InputError, match="external: is in m, needs the unit of the inner camera"):
        with_external(inner, metres)
    both = [inner.assign_attrs(warnings=f"{name}: 1 of 2 markers were lost") for name in ("in.mkv", "out.mkv")]
    assert with_external(*both).attrs["warnings"] == "in.mkv: 1 of 2 markers were lost", "detectors do not see outside"
    (tmp_path / "table.csv").write_text("file,external\none.mkv,none.mkv\n")
    with pytest.raises(InputError, match=r"names none\.mkv, needs files that are in"):
        next(recorded_trials(recordings, tmp_path / "table.csv"))
