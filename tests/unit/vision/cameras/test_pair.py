"""Both cameras of a trial at once."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import aimed_camera, external_camera, internal_camera
from fingerslip.vision.cameras.point import CameraPair, PositionErrors, metres_per_pixel, pair_tracks
from fingerslip.vision.tracks import make_tracks

NONE = PositionErrors(0.0, 0.0, 0.0)


def markers():
    position = np.zeros((2, 3, 3))
    position[:, 1:, 1], position[1, :, 0] = 5e-3, 1e-3
    position[:, 2] = np.nan
    kind = ["external", "internal", "internal"]
    return make_tracks(position, [0.0, 1.0], units="m", kind=kind, ring=[0, 0, 1], angle=[0.0] * 3)


def pair(**more):
    inside = internal_camera(50e-3, 45e-3, target=5e-3, frame_rate=20.0)
    return CameraPair(inside, external_camera(60e-3, 60e-3, frame_rate=20.0), **more)


def test_tracks_have_internal_markers_first_in_pixels_of_their_own_camera():
    found = pair_tracks(pair(errors=NONE), markers())
    assert found["kind"].values.tolist() == ["internal", "internal", "external"]
    assert found["marker"].values.tolist() == [1, 2, 0]
    assert found["ring"].values.tolist() == [0, 1, 0]
    moved = found["position"].values[-1, :, 0] - found["position"].values[0, :, 0]
    assert moved[[0, 2]] == pytest.approx([640 / 45, 640 / 60], abs=2e-3)
    assert np.isnan(moved[1])
    assert found.attrs["metres_per_pixel_x"] == pytest.approx(60e-3 / 640)
    assert found.attrs["frame_rate"] == 20.0


def test_each_camera_has_errors_of_its_own_from_one_seed():
    both = make_tracks(np.zeros((400, 2, 3)), np.arange(400) / 20.0, units="m", kind=["internal", "external"])
    first, again, other = (
        pair_tracks(pair(errors=PositionErrors(0.05, 0.0, 0.0), seed=seed), both)["position"].values
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    inside, outside = (first[:, number, 0] - first[:, number, 0].mean() for number in (0, 1))
    assert abs(np.corrcoef(inside, outside)[0, 1]) < 0.2


def test_cameras_that_are_no_pair_are_refused():
    inside, outside = internal_camera(50e-3, 45e-3), external_camera(60e-3, 60e-3, frame_rate=60.0)
    with pytest.raises(InputError, match="cameras: frame_rate: got 30 and 60 frames a second, needs one rate"):
        CameraPair(inside, outside)
    with pytest.raises(InputError, match="cameras: external: sees internal markers"):
        CameraPair(inside, inside)


def test_cameras_are_aimed_at_the_middle_from_inside_and_at_the_lowest_from_outside():
    heights = [1e-3, 3e-3, np.nan]
    inside, outside = (aimed_camera(kind, heights, 50e-3, 45e-3) for kind in ("internal", "external"))
    assert inside.pose.target[1] == pytest.approx(2e-3)
    assert outside.pose.target[1] == pytest.approx(1e-3)
    assert metres_per_pixel(inside) == pytest.approx(45e-3 / 640)
