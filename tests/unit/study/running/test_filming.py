"""Films of finished runs: both tiers, the files they leave, and what is filmed again."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.history import write_history
from fingerslip.study.definition.settings import CameraSettings
from fingerslip.study.running.pictures import camera_of, film_history, film_runs
from fingerslip.study.storage.reporting import film_keys, read_films
from fingerslip.vision.cameras.camera import pixels_of
from fingerslip.vision.tracks import make_tracks, read_tracks
from unit.filmed import filmed_history

SMALL = CameraSettings(
    width=160, height=120, view_width=14e-3, distance=30e-3, rest=0.4, marker_radius=0.3e-3, exposure=1e-3, seed=3
)
POINT = CameraSettings(tier="point", rest=0.4)


class _Plan:
    """What filming needs of a plan."""

    def __init__(self, folder, cameras, identity="a"):
        self.folder, self.source = folder, folder.with_suffix(".yaml")
        self.study = type("Study", (), {"cameras": cameras})
        self._identity = identity

    def finished_runs(self):
        return {"run": type("Result", (), {"identity": self._identity})}


class _Said:
    def __init__(self):
        self.lines = []

    def say(self, text):
        self.lines.append(text)


def test_a_pixel_camera_leaves_video_truth_and_tracks_that_agree(tmp_path):
    errors = film_history(filmed_history(), "external", SMALL, tmp_path / "cameras" / "external", "key")
    folder = tmp_path / "cameras" / "external"
    made = {path.name for path in folder.rglob("*")}
    assert made >= {"video.avi", "truth.nc", "errors.json", "tracks.nc", "tracks.csv", "overlay.avi", "quality.html"}
    assert errors.kept == 1.0
    assert errors.swapped == 0
    assert errors.rms < 0.1
    assert json.loads((folder / "errors.json").read_text())["camera"]["seed"] == 3
    truth = read_tracks(folder / "truth.nc")
    assert float(truth["time"][0]) == pytest.approx(-0.4)
    # What sticks stands still in the image of the camera that goes with the plate.
    still = truth["position"].values[:, 0]
    moved = np.linalg.norm(still[truth["time"].values < 1.6] - still[0], axis=1)
    assert (
        moved.max() < 0.01 * 160 + np.linalg.norm(np.ptp(filmed_history()["displacement"].values[:50, 0], axis=0)) * 1e5
    )


def test_a_point_camera_leaves_tracks_without_frames(tmp_path):
    errors = film_history(filmed_history(), "external", POINT, tmp_path / "cameras" / "external")
    assert not (tmp_path / "cameras" / "external" / "video.avi").exists()
    assert errors.kept == 1.0
    assert 0.0 < errors.rms < 0.02


def test_films_are_made_once_and_again_where_camera_or_run_changed(tmp_path):
    study = tmp_path / "study"
    (study / "run").mkdir(parents=True)
    write_history(filmed_history(), study / "run" / "history.nc")
    for cameras, identity, count in (
        ({"external": POINT}, "a", 1),
        ({"external": POINT}, "a", 0),
        ({"external": POINT}, "b", 1),
        ({"external": CameraSettings(tier="point", rest=0.4, seed=1)}, "b", 1),
    ):
        said = _Said()
        assert film_runs(_Plan(study, cameras, identity), said) == {}
        assert len(said.lines) == count
    assert "external camera: 5 markers in" in said.lines[0]
    assert len(film_keys(study, ["run", "other"])) == 1
    (film,) = read_films(study, {"run": filmed_history()})
    assert (film.kind, film.frames, film.numbers["markers"]) == ("external", {}, 5)


def test_markers_that_were_not_recorded_are_an_error_of_that_camera(tmp_path):
    study = tmp_path / "study"
    (study / "run").mkdir(parents=True)
    history = filmed_history()
    write_history(history.isel(site=[0, 1]), study / "run" / "history.nc")
    errors = film_runs(_Plan(study, {"internal": POINT, "external": POINT}), _Said())
    assert list(errors) == ["run/cameras/internal"]
    assert isinstance(errors["run/cameras/internal"], InputError)
    assert not (study / "run" / "cameras" / "internal").exists()


def test_cameras_aim_at_the_markers():
    markers = make_tracks([[[0.0, 1e-3], [2e-3, 3e-3]]], [0.0], units="m")
    for kind, height in (("internal", 2e-3), ("external", 1e-3)):
        camera = camera_of(SMALL, kind, markers)
        assert pixels_of(camera, np.array([0.0, height])) == pytest.approx([79.5, 59.5])
