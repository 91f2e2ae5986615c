"""Films of pixel cameras, read back with the frames that a report shows."""

from __future__ import annotations

import pytest

from fingerslip.study.definition.settings import CameraSettings
from fingerslip.study.running.pictures import film_history
from fingerslip.study.storage.films import film_keys, read_films
from unit.filmed import filmed_history

CAMERA = CameraSettings(width=160, height=120, view_width=14e-3, distance=30e-3, rest=0.4, marker_radius=0.3e-3)


def test_frames_at_rest_at_the_start_in_the_slide_and_at_its_end(tmp_path):
    film_history(filmed_history(), "external", CAMERA, tmp_path / "run" / "cameras" / "external", "key")
    assert film_keys(tmp_path, ["run"]) == ["key"]
    (film,) = read_films(tmp_path, {"run": filmed_history()})
    assert list(film.frames) == pytest.approx([-0.4, 1.0, 1.33, 2.0], abs=0.02)
    assert {frame.shape for frame in film.frames.values()} == {(120, 160)}
    assert film.truth["position"].shape == film.tracks["position"].shape
