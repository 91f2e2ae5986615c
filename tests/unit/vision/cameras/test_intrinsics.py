"""Cameras project as OpenCV does, and back; beyond the fold of the lens is NaN; their files are those of OpenCV."""

import functools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.cameras import intrinsics
from fingerslip.vision.video import opencv

POINTS = np.random.default_rng(0).uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 1.2), (100, 3))
RAYS = POINTS / np.linalg.norm(POINTS, axis=1)[:, None]
PINHOLES = [
    (),
    (-0.2, 0.05, 1e-3, -2e-3),
    (-0.2, 0.05, 1e-3, -2e-3, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01, 1e-3, -2e-3, 3e-3, -4e-3),
]


def pinhole(*distortion):
    return intrinsics.Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, distortion)


def fisheye(*distortion):
    return intrinsics.Fisheye(640, 480, 300.0, 305.0, 320.0, 240.0, distortion)


LENSES = [*[pinhole(*one) for one in PINHOLES], fisheye(), fisheye(-0.02, 0.003, -1e-3, 2e-4)]


@pytest.mark.parametrize("camera", LENSES)
def test_points_have_the_pixels_of_opencv_and_pixels_the_rays_of_points(camera):
    cv2 = opencv()
    project = cv2.projectPoints if isinstance(camera, intrinsics.Pinhole) else cv2.fisheye.projectPoints
    distortion = np.array(camera.distortion or (0.0,) * 4)
    known, _ = project(POINTS[:, None], np.zeros(3), np.zeros(3), camera.camera_matrix, distortion)
    np.testing.assert_allclose(camera.project(POINTS), known[:, 0], atol=1e-9)
    np.testing.assert_allclose(camera.directions(known[:, 0]), RAYS, atol=1e-8)
    assert camera.project(np.array([0.0, 0.0, 2.0])).tolist() == [320.0, 240.0]
    assert camera.directions(np.array([320.0, 240.0])).tolist() == [0.0, 0.0, 1.0]
    assert camera.project(np.empty((0, 3))).shape == camera.directions(np.empty((0, 2)))[:, :2].shape == (0, 2)


@given(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.05, 0.05), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)))
def test_a_pinhole_is_undone(coefficients):
    camera = pinhole(*coefficients)
    np.testing.assert_allclose(camera.directions(camera.project(POINTS)), RAYS, atol=1e-9)


@given(st.tuples(*[st.floats(-0.02, 0.02)] * 4))
def test_a_fisheye_is_undone_also_beside_and_behind_the_camera(coefficients):
    camera = fisheye(*coefficients)
    angles = np.linspace(0, 1.8, 50)
    rays = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    pixels = camera.project(rays)
    # The slope vanishes at the largest angle itself.
    inside = np.isfinite(pixels[:, 0]) & np.isfinite(camera.project(np.roll(rays, -1, axis=0))[:, 0])
    np.testing.assert_allclose(camera.directions(pixels[inside]), rays[inside], atol=1e-6)


def test_a_fisheye_sees_beside_itself_and_a_pinhole_does_not():
    beside = np.array([1.0, 0.0, 0.0])
    assert intrinsics.Fisheye(640, 480, 100.0, 100.0, 0.0, 0.0).project(beside)[0] == pytest.approx(50 * np.pi)
    assert np.isnan(pinhole().project(np.vstack([beside, -POINTS]))).all()


@pytest.mark.parametrize(
    ("camera", "largest"),
    [
        (pinhole(-0.3, 0.0, 0.0, 0.0), np.sqrt(1 / 0.9)),
        (pinhole(0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0), 2.0),  # a pole of the denominator
        (fisheye(-0.5, 0.0, 0.0, 0.0), np.tan(np.sqrt(1 / 1.5))),
    ],
)
def test_points_beyond_the_fold_of_the_lens_have_no_image_and_pixels_no_ray(camera, largest):
    seen = camera.project(np.array([[0.99 * largest, 0.0, 1.0], [1.01 * largest, 0.0, 1.0]]))
    assert np.isnan(seen[:, 0]).tolist() == [False, True]
    # Barrel distortion images at most 2/3 of the radius at which its slope vanishes.
    far = np.array([[320.0 + 500.0 * 0.71, 240.0], [2820.0, 240.0], [np.nan, 240.0]])
    assert np.isnan(camera.directions(far[2:] if len(camera.distortion) == 8 else far)).all()


@pytest.mark.parametrize("make", [intrinsics.pinhole_for_view, functools.partial(intrinsics.lens_for_view, "fisheye")])
def test_a_lens_for_a_view_sees_it_from_edge_to_edge(make):
    ends = make(640, 480, 0.1, 0.03).project(np.array([[-0.05, 0.0, 0.03], [0.05, 0.0, 0.03]]))
    np.testing.assert_allclose(ends, [[-0.5, 239.5], [639.5, 239.5]], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: pinhole(0.1, 0.2), "distortion: got 2 coefficients, needs one of 0, 4, 5, 8, 12; leave zeros"),
        (lambda: fisheye(*[0.1] * 5), "distortion: got 5 coefficients, needs one of 0, 4;"),
        (lambda: intrinsics.Pinhole(0, 480, 1.0, 1.0, 0.0, 0.0), "Pinhole.width"),
        (lambda: intrinsics.Pinhole(640, 480, -1.0, 1.0, 0.0, 0.0), "Pinhole.focal_x"),
        (lambda: intrinsics.pinhole_for_view(640, 480, 0.0, 1.0), "view_width"),
        (lambda: intrinsics.lens_for_view("fisheye", 640, 480, 0.1, -1.0), "view_width"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


@pytest.mark.parametrize("name", ["a.yaml", "a.json"])
@pytest.mark.parametrize("camera", [LENSES[0], LENSES[2], *LENSES[-2:]])
def test_files_come_back_and_opencv_reads_what_is_written_and_writes_what_is_read(tmp_path, name, camera):
    path, cv2 = tmp_path / name, opencv()
    intrinsics.write_calibration(camera, path)
    back = intrinsics.read_calibration(path)
    assert (type(back), back) == (type(camera), camera)
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), camera.camera_matrix)
    coefficients = np.array([camera.distortion or (0.0,) * 4])
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat(), coefficients)
    assert file.getNode("image_width").real() == camera.width
    file.release()
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("calibration_time", "Sun Nov 22 10:00:00 2026")
    file.write("image_width", camera.width)
    file.write("image_height", camera.height)
    file.write("fisheye_model", int(isinstance(camera, intrinsics.Fisheye)))
    file.write("camera_matrix", camera.camera_matrix)
    file.write("distortion_coefficients", coefficients.T)
    file.release()
    assert intrinsics.read_calibration(path) == camera


ROS = """image_width: 640
image_height: 480
camera_name: usb
camera_matrix:
  rows: 3
  cols: 3
  data: [500., 0., 320., 0., 510., 240., 0., 0., 1.]
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {count}
  data: {data}
"""


def test_files_of_ros_and_plain_lists_are_read(tmp_path):
    path = tmp_path / "usb.yaml"
    path.write_text(ROS.format(model="plumb_bob", count=5, data="[-0.2, 0.05, 1e-3, -2e-3, 0.]"))
    assert intrinsics.read_calibration(path) == pinhole(-0.2, 0.05, 1e-3, -2e-3)
    path.write_text(ROS.format(model="equidistant", count=4, data="[-0.2, 0.05, 0., 0.]"))
    assert intrinsics.read_calibration(path) == intrinsics.Fisheye(
        640, 480, 500.0, 510.0, 320.0, 240.0, (-0.2, 0.05, 0.0, 0.0)
    )
    path.write_text(json.dumps({"K": [[500, 0, 320], [0, 510, 240], [0, 0, 1]], "dist": [-0.2, 0, 0, 0]}))
    with pytest.raises(InputError, match=r"has no image_width and image_height, .*; give size="):
        intrinsics.read_calibration(path)
    assert intrinsics.read_calibration(path, size=(640, 480)) == pinhole(-0.2, 0, 0, 0)
    assert isinstance(intrinsics.read_calibration(path, size=(640, 480), model="fisheye"), intrinsics.Fisheye)


UNIT = "K: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nimage_size: [4, 4]\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "cannot be read"),
        (b"\x89PNG\xff\xfe", "is no text"),
        (b" " * 1_000_002, "is larger than 1 MB"),
        (b"a: 1", "has the keys a, needs camera_matrix"),
        (b"[1, 2]", "has no keys"),
        (b"{", "is no JSON"),
        (b"{]: :", "is no JSON"),
        (b"a: b: c", "found mapping values"),
        (b"camera_matrix: [1, 2]", "has a camera matrix of shape"),
        (b"camera_matrix: [1, 2, a]", "camera_matrix: got"),
        (b"camera_matrix: {rows: 2}", "needs rows, cols and data"),
        (b"K: [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]", "has a skew"),
        (f"{UNIT}distortion_model: odd".encode(), "got 'odd', needs one of"),
        (UNIT.replace("[[1", "[[-1").encode(), r"bad: Pinhole.focal_x: got -1.0, needs"),
        (f"{UNIT}D: {[1] * 14}".encode(), "14 coefficients"),
    ],
)
def test_what_is_no_calibration_is_refused(tmp_path, content, said):
    if content is not None:
        (tmp_path / "bad").write_bytes(content)
    with pytest.raises(InputError if content is not None else ResultError, match=said):
        intrinsics.read_calibration(tmp_path / "bad")
