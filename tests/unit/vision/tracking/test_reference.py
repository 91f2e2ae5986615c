"""What a tracker learns from frames at rest, and how it follows markers from frame to frame."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.marker_layouts import MarkerLayout, hexagonal_layout, ring_layout
from fingerslip.vision.tracking import follow as follow_module
from fingerslip.vision.tracking import layouts
from fingerslip.vision.tracking.blobs import Blobs
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.layouts import LayoutName, layout_of, topology
from fingerslip.vision.tracking.leaps import Match, State, rematch
from fingerslip.vision.tracking.markers import Markers, known_markers, measure
from fingerslip.vision.tracking.tracker import Reference, reference_of
from problems import clips

BRIGHT = clips.with_look(clips.BAD, marker=150.0, background=50.0)
QUIET = clips.with_look(clips.DEFAULT, noise=0.0)
FIELD = clips.field()
SEEDS = (0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2)))


def mean_frame(look: clips.Look = clips.DEFAULT, points: np.ndarray | None = None, seed: int = 0) -> np.ndarray:
    if points is None:
        return mean_of_field(look, seed)
    return np.mean(list(clips.filmed(clips.still(points, 8), look, seed=seed)), axis=0)


@functools.cache
def mean_of_field(look: clips.Look, seed: int) -> np.ndarray:
    return mean_frame(look, clips.field(look), seed)


def found_in(image: np.ndarray, count: int | None = None, layout: LayoutName = "auto") -> Reference:
    return reference_of(image, None, count, layout, None, "clip")


def learnt(image: np.ndarray, points: np.ndarray, radius: float) -> Markers:
    return known_markers(image, None, Blobs(points, np.ones(len(points)), np.full(len(points), radius)), -1.0)


@pytest.mark.parametrize("radius", [2.0, 5.0, 12.0])
@pytest.mark.parametrize("marker", [45.0, 235.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_number_size_and_polarity_are_found(radius: float, marker: float, seed: int) -> None:
    look = clips.Look(radius=radius, marker=marker, background=140.0)
    markers = found_in(mean_frame(look, seed=seed)).markers
    assert (len(markers.position), markers.polarity) == (81, 1.0 if marker > 140.0 else -1.0)
    assert np.abs(markers.radius - radius).max() < 0.35
    assert np.abs(markers.position - FIELD).max() < 0.1
    assert (markers.window < markers.spacing).all()


@pytest.mark.parametrize("changes", [{"marker": 155.0}, {"noise": 20.0}, {"blur": 4.0}])
def test_a_field_is_found_where_it_is_faint_noisy_and_blurred(changes: dict[str, float]) -> None:
    markers = found_in(mean_frame(clips.with_look(clips.DEFAULT, **changes))).markers
    assert len(markers.position) == 81
    assert np.abs(markers.position - FIELD).max() < 1.0


def grid(rows: int, columns: int, pitch: float, turn: float = 0.0) -> np.ndarray:
    points = pitch * (np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2))
    cos, sin = np.cos(turn), np.sin(turn)
    return (points - points.mean(axis=0)) @ np.array([[cos, sin], [-sin, cos]]) + [320.3, 239.8]


@pytest.mark.parametrize(
    ("points", "radius", "layout"),
    [
        (grid(5, 7, 55.0), 12.0, "grid"),
        (grid(5, 7, 60.0, turn=0.3), 9.0, "grid"),
        (clips.field(layout="hex", rings=6), 4.0, "hex"),
        (FIELD, 5.0, "rings"),
        (np.delete(grid(7, 9, 45.0), [12, 30], axis=0) + 9.0 * np.sin(np.arange(122.0).reshape(-1, 2)), 6.0, "free"),
    ],
)
def test_the_layout_is_found(points: np.ndarray, radius: float, layout: str) -> None:
    # Where nothing is regular, markers in a reflection are left out.
    for look in (clips.DEFAULT, clips.BAD) if layout != "free" else (clips.DEFAULT,):
        reference = found_in(mean_frame(clips.with_look(look, radius=radius), points=points))
        assert (reference.layout, len(reference.markers.position)) == (layout, len(points))
        assert (reference.ring is None) == (layout in {"grid", "free"})
        if layout == "grid":
            assert np.abs(reference.markers.position - points).max() < 2.0


@pytest.mark.parametrize("count", [81, None])
@pytest.mark.parametrize("look", [clips.BAD, BRIGHT], ids=["dark", "bright"])
@pytest.mark.parametrize("seed", SEEDS)
def test_glare_and_a_bright_ring_are_no_markers(count: int | None, look: clips.Look, seed: int) -> None:
    found = found_in(mean_frame(look, seed=seed), count, "rings")
    assert np.linalg.norm(found.markers.position - FIELD, axis=1).max() < 2.0
    assert found.ring is not None
    assert np.bincount(found.ring).tolist() == [1, 8, 16, 24, 32]
    assert found.warnings == ()


@pytest.mark.slow
def test_missing_markers_are_said_and_too_many_missing_ones_are_refused() -> None:
    few, fewer = (mean_frame(points=FIELD[:count]) for count in (70, 9))
    assert "found 70 of 81 markers in the first frames" in found_in(few, 81, "free").warnings[0]
    assert len(found_in(fewer, 9, "free").markers.position) == 9
    noise = np.random.default_rng(0).normal(0.0, 0.5, (240, 320))
    for image, count, words in (
        (few, 100, "clip: found 70 markers in the first frames.*needs 100; give the number"),
        (fewer, None, "found 9 markers.*needs at least 10 blobs"),
        (np.full((100, 100), 90.0), None, "found no markers"),
        ((noise + 2.0).clip(0), None, "no markers in the dark first"),
        ((noise + 253.0).clip(0, 255), None, "overexposed"),
        (noise + 120.0, None, "found no markers"),
    ):
        with pytest.raises(InputError, match=words):
            found_in(image, count, "free")


@pytest.mark.parametrize("asked", [pytest.param(5, marks=pytest.mark.slow), 75, 80])
@pytest.mark.parametrize("layout", ["rings", "free"])
def test_more_markers_than_asked_for_are_said(asked: int, layout: LayoutName) -> None:
    (said,) = found_in(mean_frame(), asked, layout).warnings
    assert said.startswith(f"clip: asked for {asked} markers, found 81 of the same kind in the first frames; give")


@pytest.mark.parametrize("seed", SEEDS)
def test_reflections_among_bright_markers_are_not_of_their_kind(seed: int) -> None:
    assert found_in(mean_frame(BRIGHT, seed=seed), 81, "free").warnings == ()


def test_the_fit_finds_a_marker_from_as_far_as_its_radius_in_any_light_and_nothing_where_nothing_is() -> None:
    markers = learnt(mean_frame(QUIET), FIELD, 5.0)
    frame = next(clips.filmed(FIELD[None], QUIET))
    for angle in np.arange(0.0, 6.0, 0.75):
        measured = measure(markers, frame, None, FIELD + 5.0 * np.array([np.cos(angle), np.sin(angle)]))
        assert np.abs(measured.position - FIELD).max() < 0.05
        assert measured.quality.min() > 0.95
    markers = learnt(mean_frame(QUIET), FIELD, 5.0)
    away = FIELD + np.array([2.0, -1.5])
    tilted = next(clips.filmed(FIELD[None], clips.with_look(QUIET, gradient=0.4)))
    assert np.abs(measure(markers, tilted, None, away).position - FIELD).max() < 0.05
    glaring, (x, y) = next(clips.filmed(FIELD[None], QUIET)).astype(float), FIELD[0]
    rows, columns = np.indices(glaring.shape)
    glaring += 90.0 * np.exp(-((columns - x - 9.0) ** 2 + (rows - y + 1.0) ** 2) / 8.0)
    found = measure(markers, glaring.clip(0, 255).astype(np.uint8), None, away)
    assert found.position[0] == pytest.approx(FIELD[0], abs=0.05)
    assert found.quality[0] < 0.97 * np.median(found.quality)
    behind, empty = np.zeros(QUIET.shape, dtype=bool), np.full(QUIET.shape, 120, dtype=np.uint8)
    for image, mask, start in ((empty, None, FIELD), (tilted, behind, FIELD), (tilted, None, -FIELD)):
        nothing = measure(markers, image, mask, start)
        assert np.isnan(nothing.position).all()
        assert (nothing.quality == 0.0).all()


def test_large_markers_whose_windows_end_at_their_neighbours_are_measured_as_well_as_small_ones() -> None:
    look = clips.with_look(clips.DEFAULT, radius=12.0)
    markers = learnt(mean_frame(look), FIELD, 12.0)
    assert np.ptp(markers.window) > 1.0, "neighbours cut some windows"
    shift = np.random.default_rng(3).uniform(-2.0, 2.0, FIELD.shape)
    frame = next(clips.filmed((FIELD + shift)[None], look, seed=5))
    assert np.abs(measure(markers, frame, None, FIELD).position - FIELD - shift).max() < 0.03


def test_markers_that_are_seen_from_the_side_are_ellipses_of_determinant_one() -> None:
    rows, columns = np.indices((120, 200))
    places = np.array([[50.0, 60.0], [150.0, 60.0]])
    image = np.full(rows.shape, 160.0)
    for x, y in places:
        image[((columns - x) / 8.0) ** 2 + ((rows - y) / 5.0) ** 2 < 1.0] = 40.0
    for a, b, c in learnt(image, places, 6.0).shape:
        assert a * c - b * b == pytest.approx(1.0)
        # The metric is the inverse of the squared axes.
        assert c / a == pytest.approx((8.0 / 5.0) ** 2, rel=0.15)
        assert b == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(
    ("layout", "name", "stretch", "bend"),
    [
        *((ring_layout(50.0), "rings", stretch, 0.0) for stretch in ((1.0, 1.0), (1.0, 0.85), (1.15, 1.0))),
        # A lens bends the lattice.
        *((hexagonal_layout(30.0, rings), "hex", (1.0, 1.0), 2e-7) for rings in (2, 6, 10)),
    ],
)
def test_markers_are_numbered_as_their_layout_is(
    layout: MarkerLayout, name: LayoutName, stretch: tuple[float, float], bend: float
) -> None:
    rng = np.random.default_rng(7)
    order = rng.permutation(layout.count)
    points = layout.position * stretch * (1.0 - bend * (layout.position**2).sum(axis=1))[:, None]
    found = topology(points[order] + rng.normal(0, 0.4, points.shape) + [320.0, 240.0], name)
    assert order[found.order].tolist() == list(range(layout.count))
    assert found.ring is not None
    assert found.ring.tolist() == layout.ring.tolist()
    assert found.complaint == ""


def test_angles_run_from_x_to_y_and_layouts_that_are_none_have_complaints() -> None:
    found, empty = (topology(ring_layout(50.0, counts).position, "rings") for counts in ((1, 8, 16), (0, 8, 16)))
    assert found.angle is not None
    assert found.angle[1:9] == pytest.approx(np.arange(8) * np.pi / 4)
    assert empty.ring is not None
    assert np.bincount(empty.ring).tolist() == [0, 8, 16]
    free = topology(np.array([[5.0, 9.0], [1.0, 2.0], [0.0, 9.0]]), "free")
    assert (free.order.tolist(), free.ring) == ([1, 2, 0], None)
    scattered = np.random.default_rng(0).uniform(0, 100, (40, 2))
    found = topology(scattered, "hex")
    off, words = found.complaint.split(maxsplit=1)
    assert words == "of 40 markers are not on the hexagonal lattice"
    assert found.ring is not None
    assert np.flatnonzero(found.ring == found.ring.max()).tolist() == list(range(40 - int(off), 40)), "in the last ring"
    assert "rings have" in topology(ring_layout(50.0, (1, 8, 16, 12)).position, "rings").complaint
    assert "not on the square grid" in topology(scattered, "grid").complaint
    assert layout_of(scattered) == "free"


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
