"""What a plane can touch."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.dynamics.statics.touchable import depth_in_hull, patches


def test_a_convex_body_hides_nothing():
    angle = np.linspace(-1.2, 1.2, 41)
    arc = np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    assert depth_in_hull(arc, np.array([0.0, 1.0])) == pytest.approx(np.zeros(41), abs=1e-12)


def test_patches_take_every_node_once():
    draw = np.random.default_rng(0)
    points, area = draw.uniform(size=(200, 3)), draw.uniform(0.5, 1.0, 200)
    middles, means = patches(points, area, 0.3)
    assert 1 < len(middles) < 200
    assert means.shape == (len(middles), 200)
    assert ((means > 0).sum(axis=0) == 1).all()
    assert np.asarray(means.sum(axis=1)).ravel() == pytest.approx(np.ones(len(middles)))


def test_without_a_distance_each_node_is_a_patch():
    points = np.random.default_rng(1).uniform(size=(7, 3))
    middles, means = patches(points, np.ones(7), 0.0)
    assert (means.toarray() == np.eye(7)).all()
    assert middles.tolist() == list(range(7))
