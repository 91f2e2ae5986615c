from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.detect.features import (
    MotionSettings,
    fill_unseen,
    markers_of,
    motion_of,
    neighbour_weights,
    rest_positions,
    velocities,
)
from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.tracks import make_tracks

LAYOUT = ring_layout(10.0, (1, 6, 12))
SETTINGS = MotionSettings(rest_frames=5, window=4)


def tracks(moved: np.ndarray, time: np.ndarray | None = None, **more: object):  # type: ignore[no-untyped-def,type-arg]
    times = np.arange(len(moved)) / 10.0 if time is None else time
    return make_tracks(LAYOUT.position + moved, times, units="px", ring=LAYOUT.ring, **more)  # type: ignore[arg-type]


@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(2, 8))
@settings(max_examples=25)
def test_the_velocity_of_uniform_motion_is_exact_at_uneven_times(x: float, y: float, window: int) -> None:
    time = np.cumsum([0.0, 0.1, 0.3, 0.05, 0.2, 0.1, 0.1])
    displacement = (time[:, None] * np.array([x, y]))[:, None, :] + np.zeros((1, 3, 1))
    found = velocities(time, displacement, np.ones((7, 3), dtype=bool), window)
    assert (found[0] == 0).all()
    assert found[1:] == pytest.approx(np.broadcast_to([x, y], (6, 3, 2)), abs=1e-9)


def test_velocity_looks_at_the_past_alone() -> None:
    time, draw = np.arange(30) / 10.0, np.random.default_rng(0)
    displacement, visible = draw.normal(size=(30, 4, 2)), draw.random((30, 4)) < 0.8
    whole = velocities(time, displacement, visible, 5)
    for end in (3, 10, 29):
        assert np.array_equal(velocities(time[:end], displacement[:end], visible[:end], 5), whole[:end])
    assert velocities(time[5:10], displacement[5:10], visible[5:10], 5)[-1] == pytest.approx(whole[9], abs=1e-12)


def test_a_marker_that_is_not_seen_moves_as_its_neighbours_do() -> None:
    moved = np.zeros((12, LAYOUT.count, 2))
    moved[5:, :, 0] = 1e-1 * np.arange(7)[:, None] + 0.01 * LAYOUT.position[:, 0]
    hidden = moved.copy()
    hidden[8:, 3] = np.nan
    whole, found = motion_of(tracks(moved), SETTINGS), motion_of(tracks(hidden), SETTINGS)
    assert found.filled == 4
    assert found.usable.all()
    assert found.displacement[:, 3] == pytest.approx(whole.displacement[:, 3], abs=0.06)
    assert np.isfinite(found.velocity).all()
    others = np.arange(LAYOUT.count) != 3
    assert np.array_equal(found.displacement[:, others], whole.displacement[:, others])


def test_frames_with_too_few_markers_are_not_usable() -> None:
    moved = np.zeros((10, LAYOUT.count, 2))
    moved[7, : LAYOUT.count // 2 + 2] = np.nan
    moved[8] = np.nan
    found = motion_of(tracks(moved), SETTINGS)
    assert np.flatnonzero(~found.usable).tolist() == [7, 8]
    assert (found.displacement[8] == 0).all()


def test_rest_is_the_mean_of_what_was_seen() -> None:
    moved = np.zeros((6, LAYOUT.count, 2))
    moved[0, :, 0], moved[1, 2] = 1.0, np.nan
    rest = rest_positions(tracks(moved), 2)
    assert rest[0] - LAYOUT.position[0] == pytest.approx([0.5, 0.0])
    assert rest[2] - LAYOUT.position[2] == pytest.approx([1.0, 0.0])


def test_bad_tracks_give_one_clear_error() -> None:
    still = np.zeros((6, LAYOUT.count, 2))
    with pytest.raises(InputError, match="have no external markers"):
        markers_of(tracks(still), "external")
    with pytest.raises(InputError, match="have 6 frames, needs the 100 at rest"):
        motion_of(tracks(still))
    still[:5, 4] = np.nan
    with pytest.raises(InputError, match="marker 4: is seen in none of the frames at rest"):
        motion_of(tracks(still), SETTINGS)


@pytest.mark.parametrize("wrong", [{"rest_frames": 0}, {"window": 1}, {"least_seen": 0.0}, {"least_seen": 1.5}])
def test_bad_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(wrong))}: got"):
        MotionSettings(**wrong)  # type: ignore[arg-type]


def test_weights_need_no_spacing() -> None:
    assert neighbour_weights(np.zeros((1, 2))).tolist() == [[0.0]]
    weights = neighbour_weights(LAYOUT.position)
    assert np.array_equal(weights, weights.T)
    assert fill_unseen(np.ones((1, 2, 2)), np.ones((1, 2), dtype=bool), np.eye(2)).tolist() == [[[1.0, 1.0]] * 2]
