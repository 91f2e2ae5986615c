"""Lenses: what they bend is bent back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.vision.cameras.calibration import write_calibration
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole
from fingerslip.vision.tracking.track import lens_of, undistort_pixels

BENT = Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, (-0.2, 0.05, 0.001, -0.002))


@pytest.mark.parametrize("lens", [BENT, Fisheye(640, 480, 300.0, 300.0, 320.0, 240.0, (0.02, 0.0, 0.0, 0.0))])
def test_positions_are_those_of_a_straight_camera(lens: Pinhole | Fisheye) -> None:
    points = np.random.default_rng(0).uniform([-0.3, -0.2, 1.0], [0.3, 0.2, 1.0], (20, 3))
    straight = points[:, :2] * (lens.focal_x, lens.focal_y) + (lens.centre_x, lens.centre_y)
    assert undistort_pixels(lens, lens.project(points)) == pytest.approx(straight, abs=1e-6)


def test_unknown_stays_unknown() -> None:
    found = undistort_pixels(BENT, np.array([[np.nan, np.nan], [320.0, 240.0]]))
    assert np.isnan(found[0]).all()
    assert found[1] == pytest.approx([320.0, 240.0])


def test_lens_of_a_file(tmp_path: Path) -> None:
    write_calibration(BENT, tmp_path / "camera.yml")
    assert lens_of(tmp_path / "camera.yml", (640, 480)) == BENT
    assert lens_of(BENT, (640, 480)) is BENT
