"""Cameras of trials."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.trials.filming import Eyes, drawn_cameras, drawn_eyes
from fingerslip.vision.cameras.point import pair_tracks
from fingerslip.vision.tracks import make_tracks

SETTINGS = TrialSettings(frame_rate=20.0)


def filmed(settings, eyes, markers):
    return pair_tracks(drawn_cameras(settings, eyes, markers), markers)


def markers():
    position = np.zeros((3, 4, 3))
    position[:, :2, 1], position[:, 1::2, 0] = 5e-3, 3e-3
    position[:, :2, 0] += np.array([0.0, 0.0, 1e-3])[:, None]
    position[:, 3] = np.nan
    kind = ["internal", "internal", "external", "external"]
    return make_tracks(position, [0.0, 1.0, 2.0], units="m", kind=kind, ring=[0, 1, 0, 1], angle=[0.0] * 4)


def test_both_cameras_see_their_markers_and_what_is_hidden_is_missing():
    found = filmed(SETTINGS, Eyes(0.0, (0.0, 0.0), 0.0, 1), markers())
    assert found.sizes == {"time": 41, "marker": 4, "axis": 2}
    assert found["position"].values[0, 0] == pytest.approx([319.5, 239.5], abs=1e-3)
    moved = found["position"].values[-1, 0, 0] - 319.5
    assert moved == pytest.approx(1e-3 / SETTINGS.metres_per_pixel, rel=0.01)
    assert np.isnan(found["position"].values[:, 3]).all()
    assert found["kind"].values.tolist() == ["internal", "internal", "external", "external"]


def test_a_camera_that_is_turned_and_moved_sees_markers_elsewhere():
    straight, turned = (
        filmed(SETTINGS, Eyes(0.0, shift, turn, 1), markers())["position"].values[0, :2]
        for shift, turn in (((0.0, 0.0), 0.0), ((1e-3, 0.0), 0.1))
    )
    sides = [two[1] - two[0] for two in (straight, turned)]
    assert np.linalg.norm(sides[0]) == pytest.approx(np.linalg.norm(sides[1]), rel=1e-2)
    angle = np.arccos(sides[0] @ sides[1] / np.prod([np.linalg.norm(one) for one in sides]))
    assert angle == pytest.approx(0.1, abs=1e-3)
    assert not np.allclose(straight[0], turned[0], atol=1.0)


def test_noise_is_that_of_the_trial():
    found = filmed(TrialSettings(frame_rate=500.0, width=640), Eyes(0.05, (0.0, 0.0), 0.0, 3), markers())
    still = found["position"].values[:500, 2]
    assert still.std(axis=0).mean() == pytest.approx(0.05, rel=0.1)


def test_trials_draw_their_own_cameras():
    first, again, other = drawn_eyes(SETTINGS, 4), drawn_eyes(SETTINGS, 4), drawn_eyes(SETTINGS, 5)
    assert first == again != other
    assert SETTINGS.noise[0] <= first.noise <= SETTINGS.noise[1]
    assert max(map(abs, first.shift)) <= SETTINGS.shift
