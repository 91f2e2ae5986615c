"""The markers at rest: blobs of an image, what is learnt of them, their numbers, and what is said of too few."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.tracking.blobs import Blobs, blobs_of, field_of
from fingerslip.vision.tracking.layouts import LayoutName, check_layout, topology
from fingerslip.vision.tracking.markers import Markers, known_markers, measure
from fingerslip.vision.tracking.reference import first_frames, reference_of
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


def learnt(image: np.ndarray, points: np.ndarray, radius: float) -> Markers:
    return known_markers(image, None, Blobs(points, np.ones(len(points)), np.full(len(points), radius)), -1.0)


@pytest.mark.parametrize("radius", [2.0, 5.0, 12.0])
@pytest.mark.parametrize("marker", [45.0, 235.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_number_size_and_polarity_are_found(radius: float, marker: float, seed: int) -> None:
    look = clips.Look(radius=radius, marker=marker, background=140.0)
    markers = reference_of(mean_frame(look, seed=seed), None, None, "auto", None, "clip").markers
    assert (len(markers.position), markers.polarity) == (81, 1.0 if marker > 140.0 else -1.0)
    assert np.abs(markers.radius - radius).max() < 0.35
    assert np.abs(markers.position - clips.field()).max() < 0.1


@pytest.mark.parametrize("changes", [{"marker": 155.0}, {"noise": 20.0}, {"blur": 4.0}])
def test_a_field_is_found_where_it_is_faint_noisy_and_blurred(changes: dict[str, float]) -> None:
    field = field_of(mean_frame(clips.with_look(clips.DEFAULT, **changes)), None, -1.0)
    apart = np.linalg.norm(field.position[:, None] - clips.field()[None], axis=2)
    assert len(field.position) == len(set(apart.argmin(axis=1))) == 81
    assert apart.min(axis=1).max() < 1.0


def test_blobs_lie_below_the_pixel_and_those_outside_the_mask_are_none() -> None:
    image, mask = mean_frame(), np.zeros(clips.DEFAULT.shape, dtype=bool)
    blobs = blobs_of(image, 5.0, -1.0, least=20.0)
    apart = np.linalg.norm(blobs.position[:, None] - clips.field()[None], axis=2)
    assert len(blobs.position) == 81
    assert apart.min(axis=1).max() < 0.15
    mask[:, :320] = True
    assert (field_of(image, mask, -1.0).position[:, 0] < 320.5).all()
    assert len(field_of(np.full((100, 100), 90.0), None, 1.0).position) == 0


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
        (clips.field(), 5.0, "rings"),
        (np.delete(grid(7, 9, 45.0), [12, 30], axis=0) + 9.0 * np.sin(np.arange(122.0).reshape(-1, 2)), 6.0, "free"),
    ],
)
def test_the_layout_is_found(points: np.ndarray, radius: float, layout: str) -> None:
    # Where nothing is regular, markers in a reflection are left out.
    for look in (clips.DEFAULT, clips.BAD) if layout != "free" else (clips.DEFAULT,):
        image = mean_frame(clips.with_look(look, radius=radius), points=points)
        reference = reference_of(image, None, None, "auto", None, "clip")
        assert (reference.layout, len(reference.markers.position)) == (layout, len(points))
        assert (reference.ring is None) == (layout in {"grid", "free"})
        if layout == "grid":
            assert np.abs(reference.markers.position - points).max() < 2.0


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
    markers = learnt(image, field + np.random.default_rng(1).uniform(-1.5, 1.5, (81, 2)), 4.0)
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


@pytest.mark.parametrize("angle", np.arange(0.0, 6.0, 0.75))
def test_the_fit_alone_finds_a_marker_from_as_far_as_its_radius(angle: float) -> None:
    field = clips.field()
    markers = learnt(mean_frame(clips.with_look(clips.DEFAULT, noise=0.0)), field, 5.0)
    frame = next(clips.filmed(field[None], clips.with_look(clips.DEFAULT, noise=0.0)))
    measured = measure(markers, frame, None, field + 5.0 * np.array([np.cos(angle), np.sin(angle)]))
    assert np.abs(measured.position - field).max() < 0.05
    assert measured.quality.min() > 0.95


def test_large_markers_whose_windows_end_at_their_neighbours_are_measured_as_well_as_small_ones() -> None:
    field, look = clips.field(), clips.with_look(clips.DEFAULT, radius=12.0)
    markers = learnt(mean_frame(look), field, 12.0)
    assert np.ptp(markers.window) > 1.0, "neighbours cut some windows"
    shift = np.random.default_rng(3).uniform(-2.0, 2.0, field.shape)
    frame = next(clips.filmed((field + shift)[None], look, seed=5))
    assert np.abs(measure(markers, frame, None, field).position - field - shift).max() < 0.03


def test_gradients_of_the_light_and_glare_beside_a_marker_do_not_pull_and_nothing_is_found_where_nothing_is() -> None:
    field, look = clips.field(), clips.with_look(clips.DEFAULT, noise=0.0)
    markers = learnt(mean_frame(look), field, 5.0)
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
    for a, b, c in learnt(image, places, 6.0).shape:
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
    assert "not on the square grid" in topology(scattered, "grid").complaint
    assert topology(scattered, "auto").layout == "free"
    with pytest.raises(InputError, match=r"layout: got 'square', needs one of auto, rings, hex, grid, free"):
        check_layout("square")
