"""What a history says of the model and its mesh."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from problems.pushed import push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))


@pytest.fixture(scope="module")
def history():
    return fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))


def test_labels_tell_what_was_recorded(history):
    assert history.site.values.tolist() == ["deep", "low"]
    assert history.site_kind.values.tolist() == ["FA-II", "SA-I"]
    assert history.site_region.values.tolist() == ["", "bulk"]
    assert history.phase_kind.values.tolist() == ["press", "hold", "slide"]
    np.testing.assert_allclose(history.phase_end.values, [0.1, 0.12, 0.22])
    assert history.counterface.values.tolist() == ["bottom"]
    np.testing.assert_array_equal(history.counterface_normal.values, [[0.0, 1.0]])
    assert history.counterface_friction_coefficient.values.tolist() == [0.4]


def test_candidates_know_how_far_they_are_from_the_ends_of_their_boundary(history):
    positions, ends = history.contact_position.values, np.array([[-4e-3, 1e-3], [4e-3, 1e-3]])
    distances = np.linalg.norm(positions[:, None] - ends, axis=2).min(axis=1)
    np.testing.assert_allclose(history.contact_edge_distance.values, distances, rtol=1e-12)


def test_boundary_that_ends_at_held_sides_has_no_free_edge():
    held = {"top": ("x", "y"), "left": ("x", "y"), "right": ("x", "y")}
    values = fs.simulate(push_and_slide(supports=held)).contact_edge_distance.values
    assert np.isinf(values).all()
