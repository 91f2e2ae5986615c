"""Bad tetrahedra are repaired, regions and outside stay."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.mesh.fragments import Fragments
from fingerslip.mesh.quality import tetrahedron_scores
from fingerslip.mesh.repair import repaired


def box(count: int = 4) -> Fragments:
    """Return a cube of two regions, which meet at y = 0.5."""
    mesh = skfem.MeshTet1.init_tensor(*[np.linspace(0.0, 1.0, count + 1)] * 3)
    cells = mesh.t.T.astype(np.int64)
    middle = mesh.p[1][cells].mean(axis=1)
    return Fragments(mesh.p.T.copy(), cells, (middle > 0.5).astype(np.int64))


def volumes(found: Fragments) -> np.ndarray:
    corners = found.points[found.cells]
    size = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    return np.bincount(found.region, weights=size)


def nearest(found: Fragments, point: tuple[float, float, float]) -> int:
    return int(np.linalg.norm(found.points - np.array(point), axis=1).argmin())


def worst(found: Fragments) -> float:
    return float(tetrahedron_scores(found.points[found.cells]).min())


def test_good_cells_stay_as_they_are() -> None:
    whole = box()
    made = repaired(whole)
    assert worst(whole) > 1.0
    assert np.array_equal(made.points, whole.points)
    assert np.array_equal(made.cells, whole.cells)
    assert np.array_equal(made.region, whole.region)


def test_a_node_inside_that_is_nearly_on_another_is_moved_or_made_one_with_it() -> None:
    bad = box()
    one, other = nearest(bad, (0.5, 0.25, 0.5)), nearest(bad, (0.75, 0.25, 0.5))
    bad.points[one] += 0.97 * (bad.points[other] - bad.points[one])
    assert worst(bad) < 1.0
    made = repaired(bad)
    assert worst(made) > 1.0
    assert volumes(made) == pytest.approx([0.5, 0.5], abs=1e-12)


def test_a_short_edge_of_the_surface_between_regions_is_made_one_node_in_it() -> None:
    bad = box()
    one, other = nearest(bad, (0.5, 0.5, 0.5)), nearest(bad, (0.75, 0.5, 0.5))
    bad.points[one] += 0.97 * (bad.points[other] - bad.points[one])
    assert worst(bad) < 1.0
    made = repaired(bad)
    assert worst(made) > 1.0
    assert volumes(made) == pytest.approx([0.5, 0.5], abs=1e-12)


def test_corners_and_planes_of_symmetry_are_kept() -> None:
    bad = box()
    one, other = nearest(bad, (0.5, 0.25, 0.0)), nearest(bad, (0.5, 0.25, 0.25))
    bad.points[other] += 0.97 * (bad.points[one] - bad.points[other])
    assert worst(bad) < 1.0
    made = repaired(bad, plane=1e-9)
    assert worst(made) > 1.0
    assert volumes(made) == pytest.approx([0.5, 0.5], abs=1e-12)
    for corner in np.ndindex(2, 2, 2):
        assert np.linalg.norm(made.points - np.array(corner), axis=1).min() == 0.0


def test_sites_stay_nodes() -> None:
    bad = box()
    one, other = nearest(bad, (0.5, 0.25, 0.5)), nearest(bad, (0.75, 0.25, 0.5))
    bad.points[one] += 0.97 * (bad.points[other] - bad.points[one])
    site = bad.points[one].copy()
    made = repaired(bad, sites=site[None])
    assert worst(made) > 1.0
    assert np.linalg.norm(made.points - site, axis=1).min() == 0.0


def test_what_cannot_be_repaired_is_left_for_the_check() -> None:
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 1e-4]])
    alone = Fragments(flat, np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=np.int64))
    assert worst(repaired(alone)) < 1.0
