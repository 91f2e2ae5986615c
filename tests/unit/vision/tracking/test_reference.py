"""The markers at rest: blobs of an image, what is learnt of them, their numbers, and what is said of too few."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.tracking.kernels import (
    AMPLITUDE,
    COLUMNS,
    CORRELATION,
    N_PROFILE,
    WEIGHT,
    learn_profiles,
    learn_shapes,
    measure_markers,
)
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
    few = markers.taken(np.arange(5))
    assert few.neighbours.max() < 5, "neighbours of their own"
    assert len(few.profiles) == len(few.shape) == 5


LOOK = clips.Look(shape=(64, 64), noise=0.0)
CIRCLE, MIDDLE = np.array([[1.0, 0.0, 1.0]]), np.array([[32.0, 32.0]])
WINDOW, RADIUS = np.array([11.0]), np.array([5.0])
EVERYWHERE = np.empty((0, 0), dtype=bool)


def frame(x: float, y: float, **changes: object) -> np.ndarray:
    return next(clips.filmed(np.array([[[x, y]]]), clips.with_look(LOOK, **changes)))


def measured(image: np.ndarray, start: tuple[float, float], mask: np.ndarray = EVERYWHERE) -> np.ndarray:
    profile = learn_profiles(frame(32.0, 32.0).astype(float), MIDDLE, WINDOW, CIRCLE, -1.0)[0]
    finite = np.flatnonzero(np.isfinite(profile))
    profile = np.interp(np.arange(N_PROFILE), finite, profile[finite])
    profile -= profile[-4:].mean()
    out = np.empty((1, COLUMNS))
    measure_markers(image, mask, np.array([start]), WINDOW, CIRCLE, profile[None] / profile[0], -1.0, out)
    return out[0]


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.25, -0.4), (0.5, 0.5), (0.13, 0.77)])
def test_centre_is_found_below_the_pixel_from_pixels_away(shift: tuple[float, float]) -> None:
    x, y = 31.0 + shift[0], 33.0 + shift[1]
    found = measured(frame(x, y), (x + 3.0, y - 2.5))
    # Grey levels are whole numbers, and the profile is that of one frame.
    assert found[:2] == pytest.approx([x, y], abs=0.05)
    assert found[AMPLITUDE] == pytest.approx(120.0, rel=0.03)
    assert found[CORRELATION] > 0.99
    assert found[WEIGHT] > 0.95


def test_gradients_of_the_light_and_glare_beside_the_marker_do_not_pull() -> None:
    image = frame(32.3, 31.6).astype(float)
    rows, columns = np.mgrid[:64, :64]
    image += 90.0 * np.exp(-((columns - 41.0) ** 2 + (rows - 31.0) ** 2) / 8.0)
    glaring = measured(image.clip(0, 255).astype(np.uint8), (32.0, 32.0))
    for found in (glaring, measured(frame(32.3, 31.6, gradient=0.4), (32.0, 32.0))):
        assert found[:2] == pytest.approx([32.3, 31.6], abs=0.05)
    assert glaring[WEIGHT] < 0.97


def test_nothing_is_found_on_an_empty_background_outside_and_behind_the_mask() -> None:
    whole = frame(32.0, 32.0)
    for found in (
        measured(np.full((64, 64), 120, dtype=np.uint8), (32.0, 32.0)),
        measured(whole, (np.nan, np.nan)),
        measured(whole, (-40.0, 5.0)),
        measured(whole, (32.0, 32.0), np.zeros((64, 64), dtype=bool)),
    ):
        assert found[CORRELATION] == 0.0
        assert np.isnan(found[0])


def test_shapes_are_ellipses_of_determinant_one() -> None:
    rows, columns = np.mgrid[:64, :64]
    image = np.where(((columns - 32) / 8.0) ** 2 + ((rows - 32) / 5.0) ** 2 < 1.0, 40.0, 160.0)
    window = np.array([14.0])
    a, b, c = learn_shapes(image, MIDDLE, RADIUS, window, -1.0)[0]
    assert a * c - b * b == pytest.approx(1.0)
    # The metric is the inverse of the squared axes.
    assert c / a == pytest.approx((8.0 / 5.0) ** 2, rel=0.15)
    assert b == pytest.approx(0.0, abs=0.01)
    line = np.where(np.abs(rows - 32) < 2, 40.0, 160.0)
    assert learn_shapes(line, MIDDLE, RADIUS, window, -1.0).tolist() == [[1.0, 0.0, 1.0]]


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
