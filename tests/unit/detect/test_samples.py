"""Labels of trials, and the frames that are sampled of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.labels import (
    GROSS,
    INCIPIENT,
    NO_SLIP,
    LabelSettings,
    Onsets,
    classes_at,
    labels_from_contact,
    labels_from_external_markers,
    labels_from_plate,
    onsets_of,
    read_onsets,
    times_of,
    write_onsets,
)
from fingerslip.detect.samples import (
    PUBLISHED_SAMPLING,
    Sampling,
    benchmark_test_trials,
    chosen_frames,
    grouped_folds,
    left_out,
    sample_split,
    samples_of,
)
from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.tracks import make_tracks

CLASSES = np.repeat([0, 1, 2], [200, 300, 100]).astype(np.int8)
USABLE = np.ones(600, dtype=bool)


def test_frames_are_sampled_as_published_by_the_seed_and_the_name_of_the_trial():
    frames = chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a")
    assert len(set(frames.tolist())) == 200
    assert np.bincount(CLASSES[frames]).tolist() == [50, 100, 50]
    assert set(range(200, 250)) <= set(frames.tolist())
    assert (np.diff(frames) > 0).all()
    frames = chosen_frames(np.zeros(600, dtype=np.int8), USABLE, PUBLISHED_SAMPLING, "a")
    assert len(frames) == 50
    one = chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a")
    assert np.array_equal(one, chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a"))
    assert not np.array_equal(one, chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "b"))
    assert not np.array_equal(one, chosen_frames(CLASSES, USABLE, Sampling(seed=1), "a"))
    usable = np.arange(600) % 2 == 0
    assert usable[chosen_frames(CLASSES, usable, PUBLISHED_SAMPLING, "a")].all()
    few = CLASSES.copy()
    few[30:200] = 1
    with pytest.raises(InputError, match=r"has 30 frames of no_slip where 50 are sampled.* --samples, .* with --least"):
        chosen_frames(few, USABLE, PUBLISHED_SAMPLING, "a")
    assert (few[chosen_frames(few, USABLE, Sampling(least=0.5), "a")] == 0).sum() == 30


def test_samples_know_their_trials(samples, trials):
    assert samples.values.shape == (len(samples.classes), len(samples.names))
    assert samples.trials == trials.names
    assert set(samples.trial.tolist()) == set(range(24))
    assert samples.filled == samples.unusable == 0
    assert samples.rest_end == pytest.approx(19 / 30)
    assert (samples.rest == 20).all()
    label = trials.onsets()[samples.trials[3]]
    slipping = np.flatnonzero((samples.trial == 3) & (samples.classes == 2))
    assert (samples.features(slipping, ("time",)) >= np.float32(label.gross)).all()
    with pytest.raises(InputError, match="trial slide-0007: has no gross slip"):
        samples_of(trials, trials.onsets() | {"slide-0007": Onsets(1.0, None)})
    with pytest.raises(InputError, match=r"trial slide-0000: slips at .* s, within the 100 .* --rest 88 or less"):
        samples_of(trials, trials.onsets())


NAMES = tuple(f"t{number:02d}" for number in range(23))


@given(st.integers(2, 23), st.integers(0, 100))
def test_every_trial_is_tested_once(folds, seed):
    found = grouped_folds(NAMES, folds, seed)
    assert len(found) == folds
    assert sorted(name for fold in found for name in fold) == sorted(NAMES)
    assert max(map(len, found)) - min(map(len, found)) <= 1


GROUPS = {f"{letter}{number}": letter for letter in "abcd" for number in range(3)}


def test_test_trials_and_groups_are_the_same_for_ever_and_conditions_are_left_out():
    found = benchmark_test_trials(NAMES)
    assert found == ("t01", "t05", "t06", "t08", "t17")
    assert benchmark_test_trials(NAMES[::-1]) == found
    assert benchmark_test_trials(NAMES, seed=1) != found
    assert sample_split(640, 0).sum() == 64
    assert (sample_split(640, 0) != sample_split(640, 1)).any()
    depths = {name: {"depth": 1e-3 * (number % 3), "mu": 0.01 * number} for number, name in enumerate(NAMES)}
    assert list(left_out(depths, "depth")) == ["0", "0.001", "0.002"]
    ranges = left_out(depths, "mu")
    assert len(ranges) == 4
    assert sorted(name for names in ranges.values() for name in names) == sorted(NAMES)
    assert left_out({"a": {"s": "wet"}, "b": {"s": "dry"}}, "s") == {"dry": ("b",), "wet": ("a",)}
    folds = grouped_folds(list(GROUPS), 2, 0, GROUPS)
    assert sorted(name for fold in folds for name in fold) == sorted(GROUPS)
    assert all(len(fold) == 6 and len({GROUPS[name] for name in fold}) == 2 for fold in folds)


LAYOUT = ring_layout(20.0, (1, 6))
REST = LabelSettings(rest_frames=3)
SCALE = {"metres_per_pixel_x": 1e-4, "metres_per_pixel_y": 1e-4}


def ramps(outer=4, central=7, frames=12):
    """Return external markers of which one moves by 1.5 px a frame from some frame on, the centre from another."""
    frame = np.arange(frames, dtype=float)
    moved = np.zeros((frames, LAYOUT.count, 2))
    moved[:, 3, 1] = 1.5 * np.maximum(frame - outer + 1, 0.0)
    moved[:, 0, 0] = 1.5 * np.maximum(frame - central + 1, 0.0)
    return make_tracks(LAYOUT.position + moved, frame / 10.0, units="px", kind="external", attributes=SCALE)


def in_metres():
    tracks = ramps().assign(position=ramps()["position"] * 1e-4)
    tracks["position"].attrs["units"] = "m"
    return tracks


def test_external_markers_give_the_published_onsets():
    # 1.5 px is beyond the 1 px of the centre at once; the 2 px of the others take a second frame.
    assert labels_from_external_markers(ramps(), REST) == Onsets(0.5, 0.7)
    metres = LabelSettings(2e-4, 1e-4, "m", rest_frames=3)
    assert labels_from_external_markers(ramps(), metres) == labels_from_external_markers(ramps(), REST)
    tracks = ramps()
    tracks["position"].values[3, 5] += 9.0
    assert labels_from_external_markers(tracks, REST).incipient == 0.3
    assert labels_from_external_markers(tracks, LabelSettings(rest_frames=3, sustained=2)).incipient == 0.5
    assert labels_from_external_markers(tracks, LabelSettings(rest_frames=3, sustained=50)) == Onsets(None, None)
    tracks = ramps(outer=50, central=50)
    tracks["position"].values[5] = np.nan
    assert labels_from_external_markers(tracks, REST) == Onsets(None, None)


def test_the_stick_ratio_and_a_plate_that_falls_give_onsets():
    ratio = np.array([np.nan, 1.0, 0.99, 0.9, 0.5, 0.0, 0.3])
    assert labels_from_contact(np.arange(7.0), ratio) == Onsets(3.0, 5.0)
    skin = ramps(outer=50, central=4, frames=16)
    frame = np.arange(16.0)
    fall = 1.5 * np.maximum(frame - 3, 0.0) + 3.0 * np.maximum(frame - 9, 0.0)
    plate = make_tracks(np.stack([fall, 0 * fall], axis=1)[:, None], frame / 10.0, units="px", attributes=SCALE)
    assert labels_from_plate(skin, plate, REST) == Onsets(0.5, 1.0)
    hidden = skin["position"].where(skin["marker"] != skin["marker"][3])
    assert labels_from_plate(skin.assign(position=hidden), plate, REST) == Onsets(0.5, 1.0)
    with pytest.raises(InputError, match="no external marker that is seen at rest"):
        labels_from_plate(skin.assign(position=skin["position"] * np.nan), plate, REST)
    with pytest.raises(InputError, match="plate: has 7 markers at 16 times, needs one"):
        labels_from_plate(skin, skin, REST)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: grouped_folds(NAMES, 24, 0), "folds: got 24, needs 2 to 23"),
        (lambda: grouped_folds(list(GROUPS), 5, 0, GROUPS), "folds: got 5, needs 2 to 4, the number of groups"),
        (lambda: left_out({"a": {"s": 1}, "b": {}}, "s"), "trial b: has no condition 's'"),
        (lambda: left_out({"a": {"s": 1}, "b": {"s": 1}}, "s"), "condition 's': is 1 in all trials"),
        (lambda: labels_from_external_markers(ramps().isel(marker=[0]), REST), "have 1 external marker, needs a"),
        (lambda: labels_from_external_markers(in_metres(), REST), "thresholds are in px, tracks in m"),
        (lambda: labels_from_contact(np.arange(2.0), np.array([0.0, 2.0])), "got 0 to 2, needs 0 to 1"),
        (lambda: labels_from_contact(np.arange(3.0), np.zeros(7)), "got shape"),
        (lambda: LabelSettings(incipient=0.0), "LabelSettings.incipient: got 0.0, needs a number > 0"),
        (lambda: LabelSettings(gross=-1.0), "LabelSettings.gross: got -1.0, needs a number > 0"),
        (lambda: LabelSettings(sustained=0), "LabelSettings.sustained: got 0, needs a number > 0"),
        (lambda: LabelSettings(units="mm"), "LabelSettings.units: got .*mm"),
        (lambda: Onsets(1.0, float("inf")), "onsets: gross: got inf"),
    ],
)
def test_what_cannot_be_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_labels_of_a_trial_are_read_back_and_what_is_missing_is_no_time(tmp_path):
    path = tmp_path / "labels.csv"
    made = {"markers": Onsets(1.0, None), "me, by eye": Onsets(0.1 + 0.2, 3.0)}
    write_onsets(made, path, key="source")
    assert read_onsets(path, "source") == made
    path.write_text("trial,incipient_s\n")
    with pytest.raises(InputError, match="has the columns trial, incipient_s, needs source, incipient_s, gross_s"):
        read_onsets(path, "source")
    (tmp_path / "a.csv").write_text("\ufefftrial,incipient_s\nt1,0.5\n", encoding="utf-8")
    assert read_onsets(tmp_path / "a.csv") == {"t1": Onsets(0.5, None)}
    with pytest.raises(InputError, match="cannot be read"):
        read_onsets(tmp_path / "none.csv")
    (tmp_path / "a.csv").write_text("trial,incipient_s,gross_s\nt1,  ,0.5\n")
    assert read_onsets(tmp_path / "a.csv") == {"t1": Onsets(None, 0.5)}
    assert onsets_of(times_of([])) == []
    assert onsets_of(times_of(made.values())) == list(made.values())
    assert Onsets(2.0, 1.0).first == Onsets(None, 1.0).first == 1.0
    assert Onsets(None, None).first is None


TIMES = st.none() | st.floats(0.0, 10.0)


@given(TIMES, TIMES)
def test_classes_follow_the_onsets(incipient, gross):
    time = np.linspace(0.0, 10.0, 41)
    found = classes_at(Onsets(incipient, gross), time)
    assert ((found == GROSS) == (time >= (np.inf if gross is None else gross))).all()
    assert ((found == NO_SLIP) == (time < min(np.inf if one is None else one for one in (incipient, gross)))).all()
    assert set(found[found == INCIPIENT]) <= {INCIPIENT}


@given(st.dictionaries(st.from_regex(r"[a-z][a-z0-9-]{0,8}", fullmatch=True), st.tuples(TIMES, TIMES), max_size=5))
def test_files_give_back_what_was_written(tmp_path_factory, made):
    path = tmp_path_factory.mktemp("onsets") / "onsets.csv"
    onsets = {name: Onsets(*times) for name, times in made.items()}
    write_onsets(onsets, path)
    assert read_onsets(path) == onsets


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "has the columns none"),
        (b"trial,onset\n", "has the columns trial, onset, needs trial, incipient_s, gross_s"),
        (b"trial,incipient_s\na,soon\n", r"incipient_s: got 'soon', needs seconds.*line 2"),
        (b"trial,incipient_s\na,nan\n", "got 'nan'"),
        (b"trial,incipient_s\na,1\na,2\n", "trial 'a' stands twice, needs each trial once .line 3"),
        (b"trial,incipient_s\n,1\n", "a row has no trial"),
        (b"trial,incipient_s,extra\na,1,2\n", "has the columns"),
        (b'trial,incipient_s\n"a,1\n', "is no CSV"),
        (b"\xff\xfe\x00", "is no CSV"),
    ],
)
def test_bad_files_give_one_clear_error(content, message, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_onsets(path)
