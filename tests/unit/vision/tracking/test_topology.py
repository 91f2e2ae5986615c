"""Numbers of markers: rings, hexagons, rows; turned, tilted and noisy."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.tracking.layouts import check_layout, topology


def shuffled(points: np.ndarray, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
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


def test_angles_run_from_x_to_y() -> None:
    found = topology(ring_layout(50.0).position, "rings")
    assert found.angle is not None
    assert found.angle[1:9] == pytest.approx(np.arange(8) * np.pi / 4)


def test_ring_without_centre_and_free_layout() -> None:
    found = topology(ring_layout(50.0, (0, 8, 16)).position, "rings")
    assert found.ring is not None
    assert np.bincount(found.ring).tolist() == [0, 8, 16]
    free = topology(np.array([[5.0, 9.0], [1.0, 2.0], [0.0, 9.0]]), "free")
    assert (free.order.tolist(), free.ring) == ([1, 2, 0], None)


def test_complaints_of_layouts_that_are_none() -> None:
    scattered = np.random.default_rng(0).uniform(0, 100, (40, 2))
    assert "not on the hexagonal lattice" in topology(scattered, "hex").complaint
    assert "rings have" in topology(ring_layout(50.0, (1, 8, 16, 12)).position, "rings").complaint
    with pytest.raises(InputError, match=r"layout: got 'square', needs one of rings, hex, free"):
        check_layout("square")
