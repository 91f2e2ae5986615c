"""Blobs of one image: number, size and polarity come from the image."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.reference import Blobs, find_blobs, spots_of
from problems import clips


def mean_frame(look: clips.Look, points: np.ndarray | None = None) -> np.ndarray:
    positions = clips.still(clips.field(look) if points is None else points, 6)
    return np.mean([frame.astype(float) for frame in clips.filmed(positions, look)], axis=0)


def blobs_of(image: np.ndarray, n_markers: int | None = None, **options) -> Blobs | None:
    return find_blobs(spots_of(image, options.get("mask"), options.get("bright")), n_markers)


@pytest.mark.parametrize("radius", [2.5, 5.0, 9.0])
@pytest.mark.parametrize("marker", [45.0, 235.0])
def test_number_size_and_polarity_are_found(radius: float, marker: float) -> None:
    blobs = blobs_of(mean_frame(clips.Look(radius=radius, marker=marker, background=140.0)))
    assert blobs is not None
    assert blobs.count == 81
    assert blobs.bright == (marker > 140.0)
    assert blobs.radius == pytest.approx(radius, rel=0.35)
    truth = clips.field()
    apart = np.linalg.norm(blobs.position[:81, None] - truth[None], axis=2)
    assert apart.min(axis=1).max() < 0.5 * radius
    assert len(set(apart.argmin(axis=1))) == 81


def test_strongest_come_first_and_stand_apart() -> None:
    blobs = blobs_of(mean_frame(clips.DEFAULT), 81)
    assert blobs is not None
    assert (np.diff(blobs.strength) <= 0).all()
    assert blobs.step > 3.0


def test_blobs_outside_the_mask_are_none() -> None:
    mask = np.zeros(clips.DEFAULT.shape, dtype=bool)
    mask[:, :320] = True
    blobs = blobs_of(mean_frame(clips.DEFAULT), mask=mask, bright=False)
    assert blobs is not None
    assert (blobs.position[:, 0] < 320).all()


def test_flat_image_has_none() -> None:
    assert blobs_of(np.full((100, 100), 90.0)) is None
