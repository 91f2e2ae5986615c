"""Motion of markers since rest, and the features that classifiers see of it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.detect import features
from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.tracks import make_tracks

DISC = ring_layout(10.0, (1, 6, 12))
MOTION = features.MotionSettings(rest_frames=5, window=4)


def moving(moved, time=None, **more):
    times = np.arange(len(moved)) / 10.0 if time is None else time
    return make_tracks(DISC.position + moved, times, units="px", ring=DISC.ring, **more)


@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(2, 8))
@settings(max_examples=25)
def test_the_velocity_of_uniform_motion_is_exact_at_uneven_times(x, y, window):
    time = np.cumsum([0.0, 0.1, 0.3, 0.05, 0.2, 0.1, 0.1])
    displacement = (time[:, None] * np.array([x, y]))[:, None, :] + np.zeros((1, 3, 1))
    found = features.velocities(time, displacement, np.ones((7, 3), dtype=bool), window)
    assert (found[0] == 0).all()
    assert found[1:] == pytest.approx(np.broadcast_to([x, y], (6, 3, 2)), abs=1e-9)


def test_a_marker_that_is_not_seen_moves_as_its_neighbours_do_and_without_enough_of_them_a_frame_is_not_used():
    moved = np.zeros((12, DISC.count, 2))
    moved[5:, :, 0] = 1e-1 * np.arange(7)[:, None] + 0.01 * DISC.position[:, 0]
    hidden = moved.copy()
    hidden[8:, 3] = np.nan
    whole, found = features.motion_of(moving(moved), MOTION), features.motion_of(moving(hidden), MOTION)
    assert (~found.seen).sum() == 4
    assert found.usable.all()
    assert found.displacement[:, 3] == pytest.approx(whole.displacement[:, 3], abs=0.06)
    assert np.isfinite(found.velocity).all()
    others = np.arange(DISC.count) != 3
    assert np.array_equal(found.displacement[:, others], whole.displacement[:, others])
    moved = np.zeros((10, DISC.count, 2))
    moved[7, : DISC.count // 2 + 2] = np.nan
    moved[8] = np.nan
    found = features.motion_of(moving(moved), MOTION)
    assert np.flatnonzero(~found.usable).tolist() == [7, 8]
    assert (found.displacement[8] == 0).all()


def test_rest_is_the_mean_of_what_was_seen_and_one_marker_has_no_neighbour():
    moved = np.zeros((6, DISC.count, 2))
    moved[0, :, 0], moved[1, 2] = 1.0, np.nan
    rest = features.rest_positions(moving(moved), 2)
    assert rest[0] - DISC.position[0] == pytest.approx([0.5, 0.0])
    assert rest[2] - DISC.position[2] == pytest.approx([1.0, 0.0])
    assert features.neighbour_weights(np.zeros((1, 2))).tolist() == [[0.0]]


def set_of(name, rest, displacement):
    """Return the columns of a set of features of markers at rest (n, 2) that were displaced (n_times, n, 2)."""
    whole = np.ones(displacement.shape[:2], dtype=bool)
    ring = np.zeros(len(rest), dtype=int)
    made = features.Motion(np.arange(len(whole)), rest, displacement, displacement, ring, whole, whole[:, 0])
    return features.FEATURE_SETS[name](made)


def unseen():
    still = np.zeros((6, DISC.count, 2))
    still[:5, 4] = np.nan
    return moving(still)


def broken():
    made = motion()
    made.displacement[2, 5] = np.nan
    return made


STILL = moving(np.zeros((6, DISC.count, 2)))
LINE = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: features.motion_of(STILL), "have 6 frames, needs the 100 at rest"),
        (lambda: features.markers_of(STILL, "external"), "no external mark"),
        (lambda: features.motion_of(unseen(), MOTION), "marker 4: is seen in none of the frames at rest"),
        (lambda: features.MotionSettings(rest_frames=0), "MotionSettings.rest_frames: got 0, needs a number > 0"),
        (lambda: features.MotionSettings(window=1), "MotionSettings.window: got 1, needs a number >= 2"),
        (lambda: features.MotionSettings(least_seen=0.0), "MotionSettings.least_seen: got 0.0, needs a number > 0"),
        (lambda: features.MotionSettings(least_seen=1.5), "MotionSettings.least_seen: got 1.5, needs a number <= 1"),
        (lambda: features.FeatureSettings(()), "features: got .*needs some of displacement"),
        (lambda: features.FeatureSettings(("colour",)), "features: got .*needs some of displacement"),
        (lambda: features.FeatureSettings(("mean", "mean")), "features: got .*needs some of displacement"),
        (lambda: features.features_of(broken(), features.FeatureSettings()), "displacement/length/5 at 2 s: is nan"),
        (lambda: set_of("strain", LINE, np.zeros((1, 3, 2))), "marker 0: is in no triangle of markers"),
        (lambda: set_of("strain", LINE[:2], np.zeros((1, 2, 2))), "marker 0"),
    ],
)
def test_bad_tracks_settings_and_features_give_one_clear_error(call, message):
    with pytest.raises(InputError, match=message):
        call()


LAYOUT = ring_layout(10.0)


def motion(turn=0.0, frames=4):
    """Return markers that move along one direction, the outer ones less, turned as a whole by some angle."""
    frame = np.arange(frames, dtype=float)[:, None]
    along = frame * (1.0 - 0.1 * LAYOUT.ring)
    moved = along[:, :, None] * np.array([np.cos(turn), np.sin(turn)])
    seen = np.ones(along.shape, dtype=bool)
    return features.Motion(frame[:, 0], LAYOUT.position, moved, 2.0 * moved, LAYOUT.ring, seen, seen[:, 0])


def columns(name, turn=0.0):
    return features.features_of(motion(turn), features.FeatureSettings((name,)))


def test_names_of_features_are_162_as_published_and_tell_the_ring():
    assert features.features_of(motion(), features.FeatureSettings()).shape == (4, 162)
    names = features.feature_names(motion(), features.FeatureSettings())
    assert names[0] == "displacement/length/0"
    assert names[-1] == "speed/length/80"
    names = features.feature_names(motion(), features.FeatureSettings(("displacement", "rings", "sliding", "time")))
    rings = features.ring_of_features(names, LAYOUT.ring)
    assert rings[:81] == LAYOUT.ring.tolist()
    assert rings[81:91] == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert rings[-1] is None
    sliding = [(name, ring) for name, ring in zip(names, rings, strict=True) if "sliding" in name]
    assert all(ring == int(name.split("_ring_")[1].split("/")[0]) for name, ring in sliding)


@pytest.mark.parametrize("name", features.FEATURE_SETS)
def test_every_set_has_a_name_for_each_column_and_needs_no_other_frame(name):
    names = features.feature_names(motion(), features.FeatureSettings((name,)))
    assert len(names) == columns(name).shape[1] == len(set(names))
    assert all(one.startswith(f"{name}/") for one in names)
    last = features.features_of(motion().at(slice(-1, None)), features.FeatureSettings((name,)))
    assert last[0] == pytest.approx(columns(name)[-1], abs=1e-6)


@pytest.mark.parametrize("turn", [np.pi / 4, np.pi / 2, 3 * np.pi / 4, np.pi])
@pytest.mark.parametrize("name", ["sliding", "rings", "mean", "residual", "entropy"])
def test_some_sets_do_not_know_the_direction(name, turn):
    # Every ring looks the same after an eighth of a turn.
    assert columns(name, turn)[1:] == pytest.approx(columns(name)[1:], abs=2e-5)


def test_polar_velocities_of_a_turn_and_of_growth():
    arm = LAYOUT.position
    turning, growing = (
        features.features_of(
            dataclasses.replace(motion(), velocity=np.tile(velocity, (4, 1, 1))), features.FeatureSettings(("polar",))
        )
        for velocity in (np.stack([-arm[:, 1], arm[:, 0]], axis=1), arm)
    )
    assert turning[:, :81] == pytest.approx(0.0, abs=1e-5)
    assert turning[:, 82:] == pytest.approx(1.0)
    assert growing[:, :81] == pytest.approx(np.broadcast_to(10.0 * LAYOUT.ring, (4, 81)), rel=1e-5)
    assert growing[:, 81:] == pytest.approx(0.0, abs=1e-6)


REST = ring_layout(1.0).position
NUMBER = st.floats(-1, 1)


@given(NUMBER, NUMBER, NUMBER)
def test_a_rigid_motion_leaves_nothing(x, y, turn):
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = np.array([x, y]) + REST @ rotation.T - REST
    assert set_of("rigid", REST, moved[None])["residual"] == pytest.approx(0.0, abs=1e-12)
    divergence, shear = set_of("strain", REST, moved[None]).values()
    assert divergence == pytest.approx(2.0 * np.cos(turn) - 2.0, abs=1e-9)
    assert shear == pytest.approx(0.0, abs=1e-9)


@given(st.lists(NUMBER, min_size=4, max_size=4))
def test_strains_of_an_affine_motion_are_exact(gradient):
    matrix = np.array(gradient).reshape(2, 2)
    divergence, shear = set_of("strain", REST, (REST @ matrix.T)[None]).values()
    green = 0.5 * (matrix + matrix.T + matrix.T @ matrix)
    assert divergence == pytest.approx(np.trace(matrix), abs=1e-9)
    assert shear == pytest.approx(np.ptp(np.linalg.eigvalsh(green)) / 2, abs=1e-9)


def test_residual_and_entropy_of_what_slips():
    moved = np.zeros((1, len(REST), 2))
    moved[0, np.linalg.norm(REST, axis=1) > 3.5, 0] = 1.0
    residual = set_of("rigid", REST, moved)["residual"]
    assert residual.max() < 1.0
    assert residual.mean() > 0.3
    even = np.ones((1, 16, 2))
    spread = np.zeros((1, 16, 2))
    spread[0, :, 0] = (np.arange(16) + 0.5) / 15.5
    assert features.entropy(even).tolist() == [0.0]
    assert features.entropy(spread) == pytest.approx(4.0)
    assert features.entropy(np.zeros((1, 16, 2))).tolist() == [0.0]
