"""Layouts of markers: counts, rings, and what lies in the axis plane."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.specimens.tactip.layout import marker_places
from fingerslip.specimens.tactip.parts import Markers


def test_rings_of_the_paper_are_81_markers():
    places = marker_places(Markers("rings", (1, 8, 16, 24, 32), 1, 3.3e-3))
    assert len(places.ring) == 81
    assert np.bincount(places.ring).tolist() == [1, 8, 16, 24, 32]
    assert np.allclose(places.along, 3.3e-3 * places.ring)
    assert places.on_plane(3.3e-3).sum() == 9


@pytest.mark.parametrize(("layers", "count"), [(1, 7), (6, 127), (10, 331)])
def test_hexagonal_counts(layers, count):
    places = marker_places(Markers("hexagonal", (1,), layers, 2e-3))
    assert len(places.ring) == count
    assert places.ring.max() == layers
    flat = places.along[:, None] * np.column_stack([np.cos(places.azimuth), np.sin(places.azimuth)])
    distance = np.linalg.norm(flat[:, None] - flat[None], axis=2) + np.eye(count)
    assert distance.min(axis=1) == pytest.approx(2e-3)


def test_chosen_places_keep_their_order():
    places = marker_places(Markers("rings", (1, 4), 1, 1e-3))
    assert places.chosen(places.ring == 1).azimuth == pytest.approx(np.pi / 2 * np.arange(4))
