"""Calibration files are those of OpenCV: it reads ours, and we read its own and others that labs have."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, read_calibration, write_calibration
from fingerslip.vision.video import opencv

CAMERAS = [
    Pinhole(640, 480, 500.25, 510.5, 320.0, 240.0),
    Pinhole(640, 480, 500.25, 510.5, 320.0, 240.0, (-0.2, 0.05, 1e-3, -2e-3, 0.01)),
    Fisheye(1920, 1080, 700.0, 700.0, 960.0, 540.0, (-0.02, 0.003, -1e-3, 2e-4)),
    Fisheye(1920, 1080, 700.0, 700.0, 960.0, 540.0),
]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("name", ["a.yaml", "a.json"])
def test_round_trip(tmp_path, camera, name):
    write_calibration(camera, tmp_path / name)
    back = read_calibration(tmp_path / name)
    assert type(back) is type(camera)
    assert back == camera


@pytest.mark.parametrize("name", ["a.yaml", "a.json"])
def test_opencv_reads_what_is_written(tmp_path, name):
    write_calibration(CAMERAS[1], tmp_path / name)
    cv2 = opencv()
    file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), CAMERAS[1].camera_matrix)
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat(), [CAMERAS[1].distortion])
    assert file.getNode("image_width").real() == 640
    file.release()


@pytest.mark.parametrize("name", ["a.yaml", "a.json"])
@pytest.mark.parametrize("camera", CAMERAS)
def test_what_opencv_writes_is_read(tmp_path, name, camera):
    cv2 = opencv()
    file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
    file.write("calibration_time", "Sun Nov 22 10:00:00 2026")
    file.write("image_width", camera.width)
    file.write("image_height", camera.height)
    file.write("fisheye_model", int(isinstance(camera, Fisheye)))
    file.write("camera_matrix", camera.camera_matrix)
    file.write("distortion_coefficients", np.array([camera.distortion or (0.0,) * 4]).T)
    file.release()
    assert read_calibration(tmp_path / name) == camera


ROS = """image_width: 640
image_height: 480
camera_name: usb
camera_matrix:
  rows: 3
  cols: 3
  data: [500.25, 0., 320., 0., 510.5, 240., 0., 0., 1.]
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {count}
  data: {data}
"""


def test_files_of_ros_are_read(tmp_path):
    path = tmp_path / "usb.yaml"
    path.write_text(ROS.format(model="plumb_bob", count=5, data="[-0.2, 0.05, 1e-3, -2e-3, 0.]"))
    assert read_calibration(path) == Pinhole(640, 480, 500.25, 510.5, 320.0, 240.0, (-0.2, 0.05, 1e-3, -2e-3))
    path.write_text(ROS.format(model="equidistant", count=4, data="[-0.2, 0.05, 0., 0.]"))
    assert read_calibration(path) == Fisheye(640, 480, 500.25, 510.5, 320.0, 240.0, (-0.2, 0.05, 0.0, 0.0))


def test_plain_lists_are_read_with_the_size_and_model_that_are_given(tmp_path):
    path = tmp_path / "calib.json"
    path.write_text(json.dumps({"K": [[500, 0, 320], [0, 510, 240], [0, 0, 1]], "dist": [-0.2, 0, 0, 0]}))
    with pytest.raises(InputError, match=r"has no image_width and image_height, .*; give size="):
        read_calibration(path)
    assert read_calibration(path, size=(640, 480)) == Pinhole(640, 480, 500, 510, 320, 240, (-0.2, 0, 0, 0))
    assert isinstance(read_calibration(path, size=(640, 480), model="fisheye"), Fisheye)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1", "has the keys a, needs camera_matrix"),
        ("[1, 2]", "has no keys"),
        ("{", "is no JSON"),
        ("{]: :", "is no JSON"),
        ("a: b: c", "found mapping values"),
        ("camera_matrix: [1, 2]", "has a camera matrix of shape"),
        ("camera_matrix: [1, 2, a]", "camera_matrix: got"),
        ("camera_matrix: {rows: 2}", "needs rows, cols and data"),
        ("K: [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]", "has a skew"),
        ("K: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nimage_size: [4, 4]\ndistortion_model: odd", "got 'odd', needs one of"),
        ("K: [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]\nimage_size: [4, 4]", r"bad: Pinhole.focal_x: got -1.0, needs"),
        (
            "K: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nimage_size: [4, 4]\nD: [1,1,1,1,1,1,1,1,1,1,1,1,1,1]",
            "14 coefficients",
        ),
    ],
)
def test_what_is_no_calibration_is_refused(tmp_path, text, said):
    (tmp_path / "bad").write_text(text)
    with pytest.raises(InputError, match=said):
        read_calibration(tmp_path / "bad")


def test_files_that_cannot_be_read_are_told(tmp_path):
    with pytest.raises(ResultError, match="cannot be read"):
        read_calibration(tmp_path / "missing.yaml")
    (tmp_path / "picture.yaml").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputError, match="is no text"):
        read_calibration(tmp_path / "picture.yaml")
    (tmp_path / "long.yaml").write_bytes(b" " * 1_000_002)
    with pytest.raises(InputError, match="is larger than 1 MB"):
        read_calibration(tmp_path / "long.yaml")
