"""The reference: markers at rest, and clear words where there are none or too few."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.tracking.layouts import LayoutName
from fingerslip.vision.tracking.reference import first_frames, reference_of
from problems import clips


def mean_frame(look: clips.Look, points: np.ndarray | None = None, seed: int = 0) -> np.ndarray:
    positions = clips.still(clips.field(look) if points is None else points, 8)
    return first_frames(clips.filmed(positions, look, seed=seed), 8)[0]


def test_mean_and_first_of_the_first_frames() -> None:
    frames = [np.full((2, 2), value, dtype=np.uint8) for value in (10, 20, 60)]
    mean, first = first_frames(iter(frames), 2)
    assert (mean == 15.0).all()
    assert first is frames[0]


SEEDS = (0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2)))


@pytest.mark.parametrize("count", [81, None])
@pytest.mark.parametrize("bright", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_glare_and_a_bright_ring_are_no_markers(count: int | None, bright: bool, seed: int) -> None:
    look = clips.with_look(clips.BAD, marker=150.0, background=50.0) if bright else clips.BAD
    found = reference_of(mean_frame(look, seed=seed), None, count, "rings", None, "clip")
    assert np.linalg.norm(found.markers.position - clips.field(), axis=1).max() < 2.0
    assert found.ring is not None
    assert np.bincount(found.ring).tolist() == [1, 8, 16, 24, 32]
    assert found.warnings == ()


def test_missing_markers_are_said_and_too_many_missing_ones_are_refused() -> None:
    few = mean_frame(clips.DEFAULT, clips.field()[:70])
    assert "found 70 of 81 markers in the first frames" in reference_of(few, None, 81, "free", None, "clip").warnings[0]
    with pytest.raises(InputError, match=r"clip: found 70 markers in the first frames.*needs 100; give the number"):
        reference_of(few, None, 100, "free", None, "clip")


@pytest.mark.parametrize("asked", [pytest.param(5, marks=pytest.mark.slow), 75, 80])
@pytest.mark.parametrize("layout", ["rings", "free"])
def test_more_markers_than_asked_for_are_said(asked: int, layout: LayoutName) -> None:
    (said,) = reference_of(mean_frame(clips.DEFAULT), None, asked, layout, None, "clip").warnings
    assert said.startswith(f"clip: asked for {asked} markers, found 81 of the same kind in the first frames; give")


@pytest.mark.parametrize("seed", SEEDS)
def test_reflections_among_bright_markers_are_not_of_their_kind(seed: int) -> None:
    look = clips.with_look(clips.BAD, marker=150.0, background=50.0)
    assert reference_of(mean_frame(look, seed=seed), None, 81, "free", None, "clip").warnings == ()


@pytest.mark.parametrize(
    ("level", "words"), [(2.0, "no markers in the dark first"), (253.0, "overexposed"), (120.0, "found no markers")]
)
def test_no_marker_at_all(level: float, words: str) -> None:
    noise = np.random.default_rng(0).normal(level, 0.5, (240, 320)).clip(0, 255)
    with pytest.raises(InputError, match=words):
        reference_of(noise, None, None, "rings", None, "clip")


def test_a_few_blobs_are_no_sensor() -> None:
    few = clips.field()[:9]
    with pytest.raises(InputError, match=r"found 9 markers.*needs at least 10 blobs"):
        reference_of(mean_frame(clips.DEFAULT, few), None, None, "free", None, "clip")
    assert len(reference_of(mean_frame(clips.DEFAULT, few), None, 9, "free", None, "clip").markers.position) == 9
