"""Layouts have the published numbers of markers, evenly spaced."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout


def test_rings_have_the_markers_of_the_paper_at_their_radii():
    layout = ring_layout(2e-3)
    assert layout.count == 81
    assert np.bincount(layout.ring).tolist() == [1, 8, 16, 24, 32]
    np.testing.assert_allclose(np.hypot(*layout.position.T), 2e-3 * layout.ring, atol=1e-18)
    np.testing.assert_allclose(np.diff(layout.angle[layout.ring == 2]), np.pi / 8)


def test_rings_may_have_no_centre():
    layout = ring_layout(1e-3, (0, 6))
    assert layout.ring.tolist() == [1] * 6


@pytest.mark.parametrize(("rings", "count"), [(0, 1), (1, 7), (6, 127), (10, 331)])
def test_hexagon_has_its_markers_at_the_pitch(rings, count):
    layout = hexagonal_layout(1e-3, rings)
    assert layout.count == count
    assert np.bincount(layout.ring).tolist() == [1, *(6 * n for n in range(1, rings + 1))]
    if rings:
        assert pdist(layout.position).min() == pytest.approx(1e-3)
    assert (layout.angle < 2 * np.pi).all()
    starts = [np.flatnonzero(layout.ring == n)[0] for n in range(rings + 1)]
    assert (layout.angle[starts] == 0).all()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ring_layout(0.0), "pitch: got 0.0"),
        (lambda: ring_layout(float("nan")), "pitch: got nan"),
        (lambda: ring_layout(1e-3, (2, 8)), "counts"),
        (lambda: ring_layout(1e-3, ()), "counts"),
        (lambda: hexagonal_layout(-1e-3, 2), "pitch"),
        (lambda: hexagonal_layout(1e-3, -1), "rings: got -1"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
