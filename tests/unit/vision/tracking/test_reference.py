"""The markers at rest: blobs of an image, what is learnt of them, their numbers, and what is said of too few."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.tracking.layouts import LayoutName, check_layout, topology
from fingerslip.vision.tracking.markers import known_markers, measure
from fingerslip.vision.tracking.reference import Blobs, find_blobs, first_frames, reference_of, spots_of
from problems import clips


def mean_frame(look: clips.Look = clips.DEFAULT, points: np.ndarray | None = None, seed: int = 0) -> np.ndarray:
    positions = clips.still(clips.field(look) if points is None else points, 8)
    return first_frames(clips.filmed(positions, look, seed=seed), 8)[0]


BRIGHT = clips.with_look(clips.BAD, marker=150.0, background=50.0)
SEEDS = (0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2)))


def test_mean_and_first_of_the_first_frames() -> None:
    frames = [np.full((2, 2), value, dtype=np.uint8) for value in (10, 20, 60)]
    mean, first = first_frames(iter(frames), 2)
    assert (mean == 15.0).all()
    assert first is frames[0]


def blobs_of(image: np.ndarray, n_markers: int | None = None, **options) -> Blobs | None:
    return find_blobs(spots_of(image, options.get("mask"), options.get("bright")), n_markers)


@pytest.mark.parametrize("radius", [2.5, 5.0, 9.0])
@pytest.mark.parametrize("marker", [45.0, 235.0])
def test_number_size_and_polarity_are_found(radius: float, marker: float) -> None:
    blobs = blobs_of(mean_frame(clips.Look(radius=radius, marker=marker, background=140.0)))
    assert blobs is not None
    assert (blobs.count, blobs.bright) == (81, marker > 140.0)
    assert blobs.radius == pytest.approx(radius, rel=0.35)
    apart = np.linalg.norm(blobs.position[:81, None] - clips.field()[None], axis=2)
    assert apart.min(axis=1).max() < 0.5 * radius
    assert len(set(apart.argmin(axis=1))) == 81


def test_strongest_blobs_come_first_and_those_outside_the_mask_are_none() -> None:
    image, mask = mean_frame(), np.zeros(clips.DEFAULT.shape, dtype=bool)
    blobs = blobs_of(image, 81)
    assert blobs is not None
    assert (np.diff(blobs.strength) <= 0).all()
    assert blobs.step > 3.0
    mask[:, :320] = True
    inside = blobs_of(image, mask=mask, bright=False)
    assert inside is not None
    assert (inside.position[:, 0] < 320).all()
    assert blobs_of(np.full((100, 100), 90.0)) is None


@pytest.mark.parametrize("count", [81, None])
@pytest.mark.parametrize("look", [clips.BAD, BRIGHT], ids=["dark", "bright"])
@pytest.mark.parametrize("seed", SEEDS)
def test_glare_and_a_bright_ring_are_no_markers(count: int | None, look: clips.Look, seed: int) -> None:
    found = reference_of(mean_frame(look, seed=seed), None, count, "rings", None, "clip")
    assert np.linalg.norm(found.markers.position - clips.field(), axis=1).max() < 2.0
    assert found.ring is not None
    assert np.bincount(found.ring).tolist() == [1, 8, 16, 24, 32]
    assert found.warnings == ()


def test_missing_markers_are_said_and_too_many_missing_ones_are_refused() -> None:
    few, fewer = (mean_frame(points=clips.field()[:count]) for count in (70, 9))
    assert "found 70 of 81 markers in the first frames" in reference_of(few, None, 81, "free", None, "clip").warnings[0]
    with pytest.raises(InputError, match=r"clip: found 70 markers in the first frames.*needs 100; give the number"):
        reference_of(few, None, 100, "free", None, "clip")
    with pytest.raises(InputError, match=r"found 9 markers.*needs at least 10 blobs"):
        reference_of(fewer, None, None, "free", None, "clip")
    assert len(reference_of(fewer, None, 9, "free", None, "clip").markers.position) == 9


@pytest.mark.parametrize("asked", [pytest.param(5, marks=pytest.mark.slow), 75, 80])
@pytest.mark.parametrize("layout", ["rings", "free"])
def test_more_markers_than_asked_for_are_said(asked: int, layout: LayoutName) -> None:
    (said,) = reference_of(mean_frame(), None, asked, layout, None, "clip").warnings
    assert said.startswith(f"clip: asked for {asked} markers, found 81 of the same kind in the first frames; give")


@pytest.mark.parametrize("seed", SEEDS)
def test_reflections_among_bright_markers_are_not_of_their_kind(seed: int) -> None:
    assert reference_of(mean_frame(BRIGHT, seed=seed), None, 81, "free", None, "clip").warnings == ()


@pytest.mark.parametrize(
    ("level", "words"), [(2.0, "no markers in the dark first"), (253.0, "overexposed"), (120.0, "found no markers")]
)
def test_no_marker_at_all(level: float, words: str) -> None:
    noise = np.random.default_rng(0).normal(level, 0.5, (240, 320)).clip(0, 255)
    with pytest.raises(InputError, match=words):
        reference_of(noise, None, None, "rings", None, "clip")


def test_what_is_learnt_is_what_was_drawn_and_measured_again_from_any_start() -> None:
    image, field = mean_frame(), clips.field()
    markers = known_markers(
        image, None, field + np.random.default_rng(1).uniform(-1.5, 1.5, (81, 2)), 4.0, bright=False
    )
    assert np.abs(markers.position - field).max() < 0.05
    assert markers.radius == pytest.approx(np.full(81, 5.0), abs=0.3)
    assert markers.quality.min() > 0.95
    assert (markers.window < markers.spacing).all()
    assert markers.polarity == -1.0
    which = np.array([3, 3, 70])
    starts = field[which] + [[1.0, 0.0], [0.0, -2.0], [2.0, 2.0]]
    found = measure(markers, image.astype(np.uint8), None, starts, which)
    assert np.abs(found.position - field[which]).max() < 0.1
    few = markers.select(np.arange(5))
    assert few.neighbours.max() < 5, "neighbours of their own"
    assert len(few.profiles) == len(few.shape) == 5


def test_large_markers_whose_windows_end_at_their_neighbours_are_measured_as_well_as_small_ones() -> None:
    field, look = clips.field(), clips.with_look(clips.DEFAULT, radius=12.0)
    markers = known_markers(mean_frame(look), None, field, 12.0, bright=False)
    assert np.ptp(markers.window) > 1.0, "neighbours cut some windows"
    shift = np.random.default_rng(3).uniform(-2.0, 2.0, field.shape)
    frame = next(clips.filmed((field + shift)[None], look, seed=5))
    assert np.abs(measure(markers, frame, None, field).position - field - shift).max() < 0.03


def test_gradients_of_the_light_and_glare_beside_a_marker_do_not_pull_and_nothing_is_found_where_nothing_is() -> None:
    field, look = clips.field(), clips.with_look(clips.DEFAULT, noise=0.0)
    markers = known_markers(mean_frame(look), None, field, 5.0, bright=False)
    away = field + np.array([2.0, -1.5])
    tilted = next(clips.filmed(field[None], clips.with_look(look, gradient=0.4)))
    assert np.abs(measure(markers, tilted, None, away).position - field).max() < 0.05
    glaring, (x, y) = next(clips.filmed(field[None], look)).astype(float), field[0]
    rows, columns = np.indices(glaring.shape)
    glaring += 90.0 * np.exp(-((columns - x - 9.0) ** 2 + (rows - y + 1.0) ** 2) / 8.0)
    found = measure(markers, glaring.clip(0, 255).astype(np.uint8), None, away)
    assert found.position[0] == pytest.approx(field[0], abs=0.05)
    assert found.quality[0] < 0.97 * np.median(found.quality)
    behind, empty = np.zeros(look.shape, dtype=bool), np.full(look.shape, 120, dtype=np.uint8)
    for image, mask, start in ((empty, None, field), (tilted, behind, field), (tilted, None, -field)):
        nothing = measure(markers, image, mask, start)
        assert np.isnan(nothing.position).all()
        assert (nothing.quality == 0.0).all()


def test_markers_that_are_seen_from_the_side_are_ellipses_of_determinant_one() -> None:
    rows, columns = np.indices((120, 200))
    places = np.array([[50.0, 60.0], [150.0, 60.0]])
    image = np.full(rows.shape, 160.0)
    for x, y in places:
        image[((columns - x) / 8.0) ** 2 + ((rows - y) / 5.0) ** 2 < 1.0] = 40.0
    for a, b, c in known_markers(image, None, places, 6.0, bright=False).shape:
        assert a * c - b * b == pytest.approx(1.0)
        # The metric is the inverse of the squared axes.
        assert c / a == pytest.approx((8.0 / 5.0) ** 2, rel=0.15)
        assert b == pytest.approx(0.0, abs=0.01)


def shuffled(points: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    order = rng.permutation(len(points))
    return points[order] + rng.normal(0, noise, points.shape), order


@pytest.mark.parametrize("stretch", [(1.0, 1.0), (1.0, 0.85), (1.15, 1.0)])
def test_rings_are_numbered_as_the_layout_is(stretch: tuple[float, float]) -> None:
    layout = ring_layout(50.0)
    points, order = shuffled(layout.position * stretch + [320.0, 240.0], 0.5)
    found = topology(points, "rings")
    assert order[found.order].tolist() == list(range(81))
    assert found.ring is not None
    assert found.ring.tolist() == layout.ring.tolist()
    assert found.complaint == ""


@pytest.mark.parametrize("rings", [2, 6, 10])
def test_hexagons_are_numbered_as_the_layout_is(rings: int) -> None:
    layout = hexagonal_layout(30.0, rings)
    # A lens bends the lattice.
    bent = layout.position * (1.0 - 2e-7 * (layout.position**2).sum(axis=1))[:, None]
    points, order = shuffled(bent, 0.3)
    found = topology(points, "hex")
    assert order[found.order].tolist() == list(range(layout.count))
    assert found.ring is not None
    assert found.ring.tolist() == layout.ring.tolist()


def test_angles_run_from_x_to_y_and_the_centre_may_be_empty() -> None:
    found, empty = (topology(ring_layout(50.0, counts).position, "rings") for counts in ((1, 8, 16), (0, 8, 16)))
    assert found.angle is not None
    assert found.angle[1:9] == pytest.approx(np.arange(8) * np.pi / 4)
    assert empty.ring is not None
    assert np.bincount(empty.ring).tolist() == [0, 8, 16]
    free = topology(np.array([[5.0, 9.0], [1.0, 2.0], [0.0, 9.0]]), "free")
    assert (free.order.tolist(), free.ring) == ([1, 2, 0], None)


def test_complaints_of_layouts_that_are_none() -> None:
    scattered = np.random.default_rng(0).uniform(0, 100, (40, 2))
    assert "not on the hexagonal lattice" in topology(scattered, "hex").complaint
    assert "rings have" in topology(ring_layout(50.0, (1, 8, 16, 12)).position, "rings").complaint
    with pytest.raises(InputError, match=r"layout: got 'square', needs one of rings, hex, free"):
        check_layout("square")
