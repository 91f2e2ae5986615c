"""Forms of laboratories come back as they were written, and what is no such form is refused."""

import numpy as np
import pandas as pd
import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.laboratories import (
    bristol_tracks,
    read_bristol,
    read_pins,
    read_series,
    write_bristol,
    write_pins,
    write_series_run,
)
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import open_frames
from unit.vision.scenes import hide, moving_tracks

SIZE = (640, 480)
POSITION = np.random.default_rng(0).uniform(0, 400, (3, 4, 2))
IMAGE = {"image_width": 640, "image_height": 480, "frame_rate": 30.0}
TRACKS = make_tracks(POSITION, np.arange(3) / 30.0, units="px", attributes=IMAGE)
FRAMES = np.random.default_rng(0).integers(0, 255, (5, 16, 24)).astype(np.uint8)


def test_data_set_of_bristol_comes_back(tmp_path):
    write_bristol(TRACKS, tmp_path / "data", labels={"pose_1": [1, 2, 3]}, image_parameters={"exposure": 7})
    data = read_bristol(tmp_path / "data")
    assert list(data.targets.columns) == ["sensor_image", "pose_1"]
    assert data.image_parameters == {"width": 640, "height": 480, "fps": 30.0, "exposure": 7}
    assert data.markers[1] == pytest.approx(POSITION[1] / SIZE)
    assert bristol_tracks(data, SIZE, 30.0)["position"].values == pytest.approx(POSITION)


def refused(said, call, *arguments):
    with pytest.raises(InputError, match=said):
        call(*arguments)


def test_markers_that_change_in_number_or_are_no_numbers_are_no_tracks(tmp_path):
    write_bristol(TRACKS, tmp_path)
    file = tmp_path / "processed_markers" / "markers_2.npy"
    np.save(file, np.zeros((5, 2)))
    refused("has 4 or 5 markers in an image", bristol_tracks, read_bristol(tmp_path), SIZE, 30.0)
    np.save(file, np.zeros(5))
    refused(r"markers_2.npy: has shape \(5,\) of float64", read_bristol, tmp_path)
    file.write_bytes(b"no array")
    refused(r"markers_2.npy: is no array", read_bristol, tmp_path)
    file.unlink()
    refused(r"markers_2.npy: cannot be read \(No such file", read_bristol, tmp_path)
    file.mkdir()
    refused(r"markers_2.npy: cannot be read \(Is a directory", read_bristol, tmp_path)


def test_damaged_and_missing_parts_of_a_data_set(tmp_path):
    targets, settings = tmp_path / "targets.csv", tmp_path / "sensor_image_params.json"
    with pytest.raises(ResultError, match=r"targets.csv: cannot be read"):
        read_bristol(tmp_path)
    for text, said in (("", "is no table"), ("pose_1\n3\n", "has no column sensor_image")):
        targets.write_text(text)
        refused(said, read_bristol, tmp_path)
    targets.write_text("sensor_image\nimage_1.png\n")
    assert read_bristol(tmp_path).markers == ()
    refused("has no processed markers", bristol_tracks, read_bristol(tmp_path), SIZE, 30.0)
    for text, said in (("{", "is no JSON"), ("[1]", "needs names and values")):
        settings.write_text(text)
        refused(said, read_bristol, tmp_path)
    refused("holds files, needs a new or an empty folder", write_bristol, TRACKS, tmp_path)
    bare = make_tracks(POSITION, np.arange(3) / 30.0, units="px")
    refused("needs pixels and the attributes image_width", write_bristol, bare, tmp_path / "data")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sensor_image_params.json", "targets.csv"]


def test_runs_come_back_and_can_be_tracked(tmp_path):
    control = pd.DataFrame({"start": [0.0], "shear_start": [0.1], "shear_end": [0.2], "end": [0.3]})
    for number in (2, 10):
        write_series_run(tmp_path, number, FRAMES, 25.0, {"control": control})
    runs = read_series(tmp_path)
    assert list(runs) == [2, 10]
    assert runs[10].tables["control"]["shear_end"].tolist() == [0.2]
    assert runs[10].frame_rate == pytest.approx(25.0)
    assert np.array_equal(list(open_frames(runs[10].images, runs[10].frame_rate).read()), FRAMES)
    write_series_run(tmp_path, 3, FRAMES, 25.0, {"image": pd.DataFrame({"file": list("abcde")})})
    run = read_series(tmp_path)[3]
    assert (run.image_times, run.frame_rate) == (None, None), "times that nobody wrote"


def test_folders_that_are_no_recording_and_runs_that_are_there(tmp_path):
    refused("has no runs", read_series, tmp_path)
    (tmp_path / "run_1").mkdir()
    refused("has no time_series_images", read_series, tmp_path)
    refused("tables: got 'sound'", write_series_run, tmp_path, 3, FRAMES, 25.0, {"sound": pd.DataFrame()})
    (tmp_path / "run_1" / "image_data.csv").write_text("theirs")
    refused("holds files, needs a new or an empty folder", write_series_run, tmp_path, 1, FRAMES, 25.0)
    assert (tmp_path / "run_1" / "image_data.csv").read_text() == "theirs"


def test_pins_come_back(tmp_path):
    tracks = hide(moving_tracks(), 2, 1)
    write_pins(tracks, tmp_path / "pins.csv")
    again = read_pins(tmp_path / "pins.csv")
    assert again["position"].values == pytest.approx(tracks["position"].values, nan_ok=True)
    assert again["time"].values == pytest.approx(tracks["time"].values)
    assert again["marker"].values.tolist() == tracks["marker"].values.tolist()
    (tmp_path / "pins.csv").write_text("pin_0_x,pin_0_y,force\n1,2,9\n3,4,9\n5,,9\n")
    tracks = read_pins(tmp_path / "pins.csv", frame_rate=20.0)
    assert tracks["time"].values.tolist() == [0.0, 0.05, 0.1]
    assert np.isnan(tracks["position"].values[2]).all()
    for text, said in (
        ("a,b\n1,2\n", "has no pins"),
        ("pin_0_x,pin_0_y,pin_1_x\n1,2,3\n", "has no column pin_1_y"),
        ("pin_0_x,pin_0_y\n1,2\n", "has no column time"),
    ):
        (tmp_path / "pins.csv").write_text(text)
        refused(said, read_pins, tmp_path / "pins.csv")
    metres = make_tracks(POSITION, np.arange(3) / 30.0, units="m")
    refused("tables of pins are in pixels", write_pins, metres, tmp_path / "pins.csv")
