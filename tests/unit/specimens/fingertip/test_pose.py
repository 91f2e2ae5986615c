"""The finger at an angle: a rigid motion that keeps the lowest point where it was."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.specimens.fingertip import pose_points, skin_grid
from unit.fingers import change_solid


@pytest.mark.parametrize("angle", [-0.4, 0.0, 0.3])
def test_lowest_point_stays_and_distances_too(angle):
    finger = change_solid(solid={"angle": f"{angle} rad"})
    grid = skin_grid(finger)
    turned = pose_points(finger, grid.reshape(-1, 3)).reshape(grid.shape)
    lowest = turned.reshape(-1, 3)[turned[..., 1].argmin()]
    assert lowest == pytest.approx([0.0, -6.5e-3, 0.0], abs=2e-4)
    assert lowest[1] == pytest.approx(-6.5e-3, abs=2e-6)
    before, after = (np.linalg.norm(points[5] - points[60], axis=1) for points in (grid, turned))
    assert np.allclose(before, after, rtol=1e-12)


def test_positive_angle_lifts_the_tip():
    tip = np.array([[8e-3, 0.0, 0.0]])
    level, lifted = (pose_points(change_solid(solid={"angle": angle}), tip)[0] for angle in ("0 rad", "0.3 rad"))
    assert np.array_equal(level, tip[0])
    assert lifted[1] > level[1] + 1e-3
