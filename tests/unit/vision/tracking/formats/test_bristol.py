"""Data sets of the form that is used in Bristol."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.laboratories import bristol_tracks, read_bristol, write_bristol
from fingerslip.vision.tracks import make_tracks

SIZE = (640, 480)
POSITION = np.random.default_rng(0).uniform(0, 400, (3, 4, 2))
TRACKS = make_tracks(
    POSITION, np.arange(3) / 30.0, units="px", attributes={"image_width": 640, "image_height": 480, "frame_rate": 30.0}
)


def test_data_set_comes_back(tmp_path: Path) -> None:
    write_bristol(TRACKS, tmp_path / "data", labels={"pose_1": [1, 2, 3]}, image_parameters={"exposure": 7})
    data = read_bristol(tmp_path / "data")
    assert list(data.targets.columns) == ["sensor_image", "pose_1"]
    assert data.image_parameters == {"width": 640, "height": 480, "fps": 30.0, "exposure": 7}
    assert data.markers[1] == pytest.approx(POSITION[1] / SIZE)
    again = bristol_tracks(data, SIZE, 30.0)
    assert again["position"].values == pytest.approx(POSITION)


def test_markers_that_change_in_number_are_no_tracks(tmp_path: Path) -> None:
    write_bristol(TRACKS, tmp_path / "data")
    np.save(tmp_path / "data" / "processed_markers" / "markers_2.npy", np.zeros((5, 2)))
    with pytest.raises(InputError, match="has 4 or 5 markers in an image"):
        bristol_tracks(read_bristol(tmp_path / "data"), SIZE, 30.0)
    np.save(tmp_path / "data" / "processed_markers" / "markers_2.npy", np.zeros(5))
    with pytest.raises(InputError, match=r"markers_2.npy: has shape \(5,\) of float64"):
        read_bristol(tmp_path / "data")
    (tmp_path / "data" / "processed_markers" / "markers_2.npy").unlink()
    with pytest.raises(InputError, match=r"markers_2.npy: there is no such file"):
        read_bristol(tmp_path / "data")


def test_damaged_and_missing_parts(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"targets.csv: there is no such file"):
        read_bristol(tmp_path)
    (tmp_path / "targets.csv").write_text("pose_1\n3\n")
    with pytest.raises(InputError, match="has no column sensor_image"):
        read_bristol(tmp_path)
    (tmp_path / "targets.csv").write_text("sensor_image\nimage_1.png\n")
    assert read_bristol(tmp_path).markers == ()
    with pytest.raises(InputError, match="has no processed markers"):
        bristol_tracks(read_bristol(tmp_path), SIZE, 30.0)
    (tmp_path / "sensor_image_params.json").write_text("{")
    with pytest.raises(InputError, match="is no JSON"):
        read_bristol(tmp_path)


def test_tracks_without_the_size_of_the_image_are_not_written(tmp_path: Path) -> None:
    bare = make_tracks(POSITION, np.arange(3) / 30.0, units="px")
    with pytest.raises(InputError, match="needs pixels and the attributes image_width"):
        write_bristol(bare, tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_a_data_set_that_is_there_is_not_replaced(tmp_path):
    (tmp_path / "targets.csv").write_text("theirs")
    with pytest.raises(InputError, match="holds files, needs a new or an empty folder"):
        write_bristol(TRACKS, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["targets.csv"]
