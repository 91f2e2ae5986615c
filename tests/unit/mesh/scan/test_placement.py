"""Placement: tip to +x, pad down, first touch at y = 0, however the finger lay in the scanner."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.placement import Placement, place_surface, placement_from_directions, placement_from_landmarks
from unit.ellipsoids import ellipsoid

FINGER = ellipsoid()
TIP, PAD = np.array([0.9, 0.3, -0.2]), np.array([0.1, -1.0, 0.2])


@given(st.integers(0, 2**32 - 1))
def test_any_pose_comes_back(seed: int):
    rotation = Rotation.random(random_state=seed).as_matrix()
    scanned = place_surface(FINGER, Placement(rotation, np.array([0.3, -0.1, 0.5])))
    placement = placement_from_directions(scanned, rotation @ TIP, rotation @ PAD)
    assert placement.rotation @ placement.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(placement.rotation) == pytest.approx(1.0)
    placed = place_surface(scanned, placement)
    assert placed.volume == pytest.approx(FINGER.volume)
    assert placed.points[:, 0].max() == pytest.approx(0.0, abs=1e-12)
    assert placed.points[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(placed.points[:, 0]) == pytest.approx(24e-3, rel=0.01)
    assert placement.rotation @ (rotation @ [1.0, 0.0, 0.0]) == pytest.approx([1.0, 0.0, 0.0], abs=0.02)


@pytest.mark.parametrize("angle", [0.0, 20.0, -10.0])
def test_plate_angle_lowers_the_tip(angle: float):
    placement = placement_from_directions(FINGER, (1, 0, 0), (0, -1, 0), np.radians(angle))
    tip = placement.rotation @ [1.0, 0.0, 0.0]
    assert np.degrees(np.arcsin(-tip[1])) == pytest.approx(angle, abs=1.0)


def test_landmarks_give_the_axes():
    placement = placement_from_landmarks(FINGER, (12e-3, 1e-3, 0), (-12e-3, 1e-3, 0), (0, -8e-3, 0))
    assert placement.rotation == pytest.approx(np.eye(3), abs=1e-12)
    assert placement.shift == pytest.approx([-12e-3, 8e-3, 0.0], abs=0.2e-3)


def test_tip_direction_across_the_finger():
    with pytest.raises(MeshError, match=r"long axis is 9. degrees off|long axis is [78]. degrees off"):
        placement_from_directions(FINGER, (0, 1, 0), (0, 0, -1))


def test_parallel_directions():
    with pytest.raises(InputError, match="pad: is parallel"):
        placement_from_landmarks(FINGER, (1, 0, 0), (0, 0, 0), (2, 0, 0))


@pytest.mark.parametrize("tip", [(0, 0, 0), (1, 0), (np.nan, 0, 1)])
def test_no_direction(tip):
    with pytest.raises(InputError, match="tip: got"):
        placement_from_directions(FINGER, tip, (0, -1, 0))
