"""A step of the tracker: it keeps to the marker, says when it is gone, finds it again, and heeds its neighbours."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.vision.tracking import follow as follow_module
from fingerslip.vision.tracking import layouts
from fingerslip.vision.tracking.blobs import Blobs
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.leaps import Match, State, rematch
from fingerslip.vision.tracking.markers import Markers
from fingerslip.vision.tracking.tracker import reference_of
from problems import clips

FIELD = clips.field()


def at_rest(points: np.ndarray, layout: str) -> Markers:
    image = np.mean(list(clips.filmed(clips.still(points, 4))), axis=0)
    return reference_of(image, None, len(points), layout, None, "clip").markers


@pytest.fixture(scope="module")
def markers() -> Markers:
    return at_rest(FIELD, "rings")


def one(positions: np.ndarray, hidden: list[int] | None = None) -> np.ndarray:
    gone = np.zeros((1, len(positions)), dtype=bool)
    gone[0, hidden or []] = True
    return next(clips.filmed(positions[None], hidden=gone))


def begun(markers: Markers) -> State:
    return follow(markers, rest_state(markers), one(FIELD), None)[0]


# Markers are 44 px apart: beyond half of that only the pattern as a whole tells where they went.
@pytest.mark.parametrize("step", [0.1, 9.0, 15.0, 30.0, 44.0])
def test_sudden_step_of_all_markers_is_followed(markers: Markers, step: float) -> None:
    moved = FIELD + np.array([0.8 * step, 0.6 * step])
    _, found, quality = follow(markers, begun(markers), one(moved), None)
    assert np.abs(found - moved).max() < 0.05
    assert quality.min() > 0.4


def test_hidden_marker_is_not_a_number_and_comes_back_with_less_quality(markers: Markers) -> None:
    state, gone = begun(markers), [0, 17, 80]
    for shift in range(1, 12):
        here = FIELD + np.array([2.0 * shift, 0.0])
        state, found, quality = follow(markers, state, one(here, gone), None)
        assert np.isnan(found[gone]).all()
        assert (quality[gone] == 0.0).all()
        assert np.isfinite(np.delete(found, gone, axis=0)).all()
    assert not state.seen[gone].any()
    state, found, quality = follow(markers, state, one(here), None)
    assert np.abs(found - here).max() < 0.05
    assert (quality[gone] < 0.6).all()
    _, _, quality = follow(markers, state, one(here), None)
    assert quality[gone].min() > 0.9


def test_frame_that_shows_nothing_changes_nothing(markers: Markers) -> None:
    state = begun(markers)
    after, found, quality = follow(markers, state, np.zeros(clips.DEFAULT.shape, dtype=np.uint8), None)
    assert np.isnan(found).all()
    assert (quality == 0).all()
    assert (after.image is state.image, after.position is state.position, after.visible) == (True, True, 0)
    _, found, _ = follow(markers, after, one(FIELD + 8.0), None)
    assert np.abs(found - FIELD - 8.0).max() < 0.05


def test_a_frame_in_which_all_leap_to_what_is_no_marker_leaves_the_light(markers: Markers, monkeypatch) -> None:
    state = begun(markers)
    beside = np.random.default_rng(1).uniform((5.0, 5.0), (90.0, 475.0), (len(FIELD), 2))

    def leapt(_markers, _before, match):
        return dataclasses.replace(match, position=beside, guess=state.position)

    monkeypatch.setattr(follow_module, "untangle", leapt)
    after, found, _ = follow(markers, state, one(FIELD), None)
    assert np.isnan(found).all()
    assert after.light == state.light


def test_a_marker_whose_blob_another_takes_has_none() -> None:
    # The third reaches the new blob, the first takes its blob then; the second is nearer to the blob of the fourth.
    guess = np.array([[50.0, 50.0], [50.0, 160.0], [90.0, 50.0], [50.0, 110.0]])
    blobs = Blobs(np.array([[70.0, 50.0], [50.0, 150.0], [130.0, 50.0]]), np.ones(3), np.ones(3))
    sure, used = np.array([False, False, True, True]), np.array([0, 0, 0, 1])
    position = np.where(sure[:, None], blobs.position[used], guess)
    markers = dataclasses.replace(
        at_rest(FIELD[:7], "free").select(np.arange(4)), spacing=np.full(4, 40.0), radius=np.full(4, 5.0)
    )
    match = Match(guess, position, sure, used, np.zeros(4, dtype=bool), 0.0)
    state = State(guess, np.ones(4, dtype=bool), 1.0, None, guess)
    new = rematch(markers, state, np.zeros((200, 200), dtype=np.uint8), blobs, match)
    assert new.sure.tolist() == [True, True, True, False]
    assert new.used[new.sure].tolist() == [0, 1, 2]


@pytest.mark.slow
def test_markers_that_move_apart_from_their_neighbours_are_kept() -> None:
    rest = np.column_stack([197.0 + 30.0 * np.arange(9), np.full(9, 240.0)])
    markers = at_rest(rest, "free")
    order, state = np.argsort(markers.position[:, 0]), rest_state(markers)
    for step in range(40):
        # Every second marker goes the other way, by 8 px in the end, as crowns of a ridged skin that roll.
        here = rest + np.column_stack([0.2 * step * np.where(np.arange(9) % 2, 1.0, -1.0), np.zeros(9)])
        state, found, _ = follow(markers, state, one(here), None)
        assert np.abs(found[order] - here).max() < 0.05


NEIGHBOURS, SPACING = layouts.nearest_neighbours(FIELD)
ALL = np.ones(81, dtype=bool)


def test_motions_that_neighbours_share_are_expected_and_strangers_are_left_out() -> None:
    assert NEIGHBOURS.shape == (81, 8)
    assert layouts.nearest_neighbours(FIELD[:1])[1].tolist() == [np.inf]
    some, random = np.arange(81) % 3 > 0, np.random.default_rng(0).normal(size=(81, 2))
    moved, counts = layouts.expected_displacement(random, some, NEIGHBOURS)
    assert moved == pytest.approx(np.array([np.median(random[row[some[row]]], axis=0) for row in NEIGHBOURS]))
    assert counts.tolist() == some[NEIGHBOURS].sum(axis=1).tolist()
    moved, counts = layouts.expected_displacement(random, ~ALL, NEIGHBOURS)
    assert np.isnan(moved).all()
    assert counts.sum() == 0
    displacement, wrong = 0.05 * (FIELD - FIELD[0]) + [10.0, 0.0], [5, 6, 40, 80]
    displacement[wrong] += [[25.0, 0.0], [25.0, 0.0], [0.0, -30.0], [-20.0, 20.0]]
    agreed = layouts.consistent(displacement, ALL, NEIGHBOURS, 0.3 * SPACING)
    assert np.flatnonzero(~agreed).tolist() == wrong
    assert layouts.consistent(displacement, ~ALL, NEIGHBOURS, SPACING).sum() == 0


@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 99))
def test_nobody_is_matched_twice_or_from_too_far(n: int, m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    expected, candidates = rng.uniform(0, 30, (n, 2)), rng.uniform(0, 30, (m, 2))
    rows, columns = layouts.assign(expected, np.full(n, 12.0), candidates)
    assert len(set(rows)) == len(rows)
    assert len(set(columns)) == len(columns) == len(rows)
    assert (np.linalg.norm(expected[rows] - candidates[columns], axis=1) <= 12.0).all()
