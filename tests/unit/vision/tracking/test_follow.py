"""A step of the tracker: it keeps to the marker, says when it is gone, and finds it again."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.follow import State, follow, rest_state
from fingerslip.vision.tracking.reference import Reference, first_frames, reference_of
from problems import clips


@pytest.fixture(scope="module")
def reference() -> Reference:
    frames = clips.filmed(clips.still(clips.field(), 4))
    return reference_of(first_frames(frames, 4)[0], None, 81, "rings", None, "clip")


def one(positions: np.ndarray, hidden: list[int] | None = None) -> np.ndarray:
    gone = np.zeros((1, len(positions)), dtype=bool)
    gone[0, hidden or []] = True
    return next(clips.filmed(positions[None], hidden=gone))


def begun(reference: Reference) -> State:
    return follow(reference.markers, rest_state(reference.markers), one(clips.field()), None)[0]


# Markers are 44 px apart: beyond half of that only the pattern as a whole tells where they went.
@pytest.mark.parametrize("step", [0.1, 3.0, 9.0, 15.0, 30.0, 44.0])
def test_sudden_step_of_all_markers_is_followed(reference: Reference, step: float) -> None:
    moved = clips.field() + np.array([0.8 * step, 0.6 * step])
    _, found, quality = follow(reference.markers, begun(reference), one(moved), None)
    assert np.abs(found - moved).max() < 0.05
    assert quality.min() > 0.4


def test_hidden_marker_is_not_a_number_and_comes_back_with_less_quality(reference: Reference) -> None:
    state, markers, gone = begun(reference), reference.markers, [0, 17, 80]
    for shift in range(1, 12):
        here = clips.field() + np.array([2.0 * shift, 0.0])
        state, found, quality = follow(markers, state, one(here, gone), None)
        assert np.isnan(found[gone]).all()
        assert (quality[gone] == 0.0).all()
        assert np.isfinite(np.delete(found, gone, axis=0)).all()
    assert (state.missing[gone] == 11).all()
    state, found, quality = follow(markers, state, one(here), None)
    assert np.abs(found - here).max() < 0.05
    assert (quality[gone] < 0.6).all()
    _, _, quality = follow(markers, state, one(here), None)
    assert quality[gone].min() > 0.9


def test_frame_that_shows_nothing_changes_no_memory(reference: Reference) -> None:
    state = begun(reference)
    dark = np.zeros(clips.DEFAULT.shape, dtype=np.uint8)
    after, found, quality = follow(reference.markers, state, dark, None)
    assert np.isnan(found).all()
    assert (quality == 0).all()
    assert after.image is state.image
    _, found, _ = follow(reference.markers, after, one(clips.field() + 8.0), None)
    assert np.abs(found - clips.field() - 8.0).max() < 0.05


def test_markers_that_move_apart_from_their_neighbours_are_kept() -> None:
    rest = np.column_stack([197.0 + 30.0 * np.arange(9), np.full(9, 240.0)])
    frames = clips.filmed(clips.still(rest, 4))
    reference = reference_of(first_frames(frames, 4)[0], None, 9, "free", None, "clip")
    order = np.argsort(reference.markers.position[:, 0])
    state = rest_state(reference.markers)
    for step in range(40):
        # Every second marker goes the other way, by 8 px in the end, as crowns of a ridged skin that roll.
        here = rest + np.column_stack([0.2 * step * np.where(np.arange(9) % 2, 1.0, -1.0), np.zeros(9)])
        state, found, _ = follow(reference.markers, state, one(here), None)
        assert np.abs(found[order] - here).max() < 0.05
