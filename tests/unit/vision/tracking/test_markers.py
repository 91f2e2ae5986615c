"""What is learnt of markers: their radius, their windows, their profiles."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.markers import known_markers, measure
from problems import clips


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    frames = clips.filmed(clips.still(clips.field(), 8), clips.DEFAULT)
    return np.mean([frame.astype(float) for frame in frames], axis=0)


def test_centres_and_radii_are_those_that_were_drawn(image: np.ndarray) -> None:
    rough = clips.field() + np.random.default_rng(1).uniform(-1.5, 1.5, (81, 2))
    markers = known_markers(image, None, rough, 4.0, bright=False)
    assert np.abs(markers.position - clips.field()).max() < 0.05
    assert markers.radius == pytest.approx(np.full(81, 5.0), abs=0.3)
    assert markers.quality.min() > 0.95
    assert (markers.window < markers.spacing).all()
    assert markers.polarity == -1.0


def test_measured_from_starts_of_some_markers_only(image: np.ndarray) -> None:
    markers = known_markers(image, None, clips.field(), 5.0, bright=False)
    which = np.array([3, 3, 70])
    starts = clips.field()[which] + [[1.0, 0.0], [0.0, -2.0], [2.0, 2.0]]
    found = measure(markers, image.astype(np.uint8), None, starts, which)
    assert np.abs(found.position - clips.field()[which]).max() < 0.1


def test_taken_markers_have_neighbours_of_their_own(image: np.ndarray) -> None:
    markers = known_markers(image, None, clips.field(), 5.0, bright=False).taken(np.arange(5))
    assert markers.neighbours.max() < 5
    assert len(markers.profiles) == len(markers.shape) == 5
