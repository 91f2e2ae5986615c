"""Tracks have one form, come back bit by bit, say what is wrong with them, and are compared with the truth."""

import h5py
import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.comparison import PositionErrors, matched_tracks, position_errors, track_errors
from fingerslip.vision.tracks import (
    VARIABLES,
    check_tracks,
    make_tracks,
    read_tracks,
    read_tracks_csv,
    seen,
    tracks_from_table,
    tracks_in_metres,
    tracks_table,
    write_tracks,
    write_tracks_csv,
)
from unit.vision.scenes import hide, moving_tracks


def test_variables_have_units_and_a_marker_that_was_not_seen_no_quality():
    tracks = moving_tracks(attributes={"frame_rate": 30.0, "source": None})
    assert set(tracks.variables) == set(VARIABLES)
    for name, (dims, unit, meaning) in VARIABLES.items():
        assert tracks[name].dims == dims
        assert tracks[name].attrs == {"units": unit, "long_name": meaning}
    assert tracks.attrs == {"frame_rate": 30.0}
    assert set(map(str, tracks["kind"].values)) == {"internal"}
    tracks = moving_tracks()
    assert np.argwhere(~seen(tracks)).tolist() == [[1, 24]]
    np.testing.assert_array_equal(tracks["quality"].values, seen(tracks).astype(float))
    position = np.zeros((1, 1, 2))
    tracks = make_tracks(position, [0.0], units="m")
    position[:] = 7.0
    assert float(tracks["position"].max()) == 0.0


@pytest.mark.parametrize(("units", "dim"), [("px", 2), ("m", 2), ("m", 3)])
def test_round_trips_keep_every_bit_or_in_csv_nearly(tmp_path, units, dim):
    kinds = ["internal"] * 20 + ["external"] * 5
    tracks = moving_tracks(units=units, dim=dim, kind=kinds, attributes={"image_width": 640, "source": "a test"})
    write_tracks_csv(tracks, tmp_path / "tracks.csv")
    again = read_tracks_csv(tmp_path / "tracks.csv")
    xr.testing.assert_allclose(again, tracks, rtol=1e-15, atol=0.0)  # older pandas reads to a rounding
    (tmp_path / "tracks.csv").unlink()
    write_tracks(tracks, tmp_path / "tracks.nc")
    back = read_tracks(tmp_path / "tracks.nc")
    xr.testing.assert_equal(back, tracks)
    for name in tracks.variables:
        assert back[name].dtype.kind == tracks[name].dtype.kind
        assert back[name].attrs == tracks[name].attrs
    assert back.attrs == tracks.attrs
    assert [entry.name for entry in tmp_path.iterdir()] == ["tracks.nc"]


TWO = np.zeros((2, 2, 2))
ONE_AXIS = np.array([[[0.0, 0.0], [0.0, np.nan]], [[0.0, 0.0], [0.0, 0.0]]])


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"position": np.zeros((2, 2))}, r"tracks: position: got shape \(2, 2\)"),
        ({"position": np.zeros((2, 2, 4))}, "needs"),
        ({"time": [0.0]}, r"tracks: time: got shape \(1,\), needs \(2,\)"),
        ({"time": [0.0, 0.0]}, "does not rise after 0 s"),
        ({"time": [0.0, np.nan]}, "time"),
        ({"units": "mm"}, "has the unit 'mm', needs one of px, m"),
        ({"units": "px", "position": np.zeros((2, 2, 3))}, "positions in px have the axes x and y"),
        ({"kind": "inner"}, "kind: got 'inner', needs one of internal, external"),
        ({"marker": [1, 1]}, "marker: 1 stands twice"),
        ({"marker": [0.5, 1.5]}, "marker: has the type float64"),
        ({"ring": [0.0, 1.0]}, "ring: has the type float64"),
        ({"quality": [[0.0, 2.0], [0.0, 0.0]]}, "quality: marker 1 at 0 s has 2.0, needs a number from 0 to 1"),
        ({"quality": [[0.0, np.nan], [0.0, 0.0]]}, "has nan"),
        ({"position": ONE_AXIS}, "position: marker 1 at 0 s has"),
        ({"position": TWO + np.inf}, "has .inf inf., needs finite"),
        ({"position": TWO + np.nan, "quality": np.ones((2, 2))}, "0 where the position is NaN"),
        ({"attributes": {"frame_rate": 0.0}}, "frame_rate: got 0.0, needs a number > 0"),
        ({"attributes": {"image_width": "640"}}, "image_width: got '640'"),
        ({"attributes": {"image_width": True}}, "image_width: got True"),
    ],
)
def test_what_cannot_be_is_refused(values, said):
    given = {"position": TWO, "time": [0.0, 1.0], "units": "m"} | values
    with pytest.raises(InputError, match=said):
        make_tracks(**given)


def in_units(tracks=None, **units):
    """Return tracks whose variables say that they have other units."""
    tracks = moving_tracks() if tracks is None else tracks
    for name, unit in units.items():
        tracks[name].attrs["units"] = unit
    return tracks


def test_missing_damaged_and_other_files_are_told_and_no_frames_are_tracks(tmp_path):
    path = tmp_path / "tracks.nc"
    with pytest.raises(ResultError, match=r"tracks.nc: is not there; needs a file of tracks"):
        read_tracks(path)
    write_tracks(moving_tracks(), path)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(ResultError, match=r"tracks.nc: cannot be read as tracks .*; make the tracks again"):
        read_tracks(path)
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"a.nc: has no 'position'"):
        read_tracks(tmp_path / "a.nc")
    write_tracks(make_tracks(np.empty((0, 0, 2)), [], units="px"), tmp_path / "empty.nc")
    assert read_tracks(tmp_path / "empty.nc").sizes == {"time": 0, "marker": 0, "axis": 2}


def test_other_units_of_a_file_are_converted_or_refused(tmp_path):
    angles = {"angle": ("marker", [0.0, 90.0])}
    tracks = make_tracks(TWO, [0.0, 500.0], units="m").assign_coords(angles)
    in_units(tracks, time="ms", position="mm").assign_coords(angles).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with h5py.File(tmp_path / "a.nc", "a") as file:
        file["angle"].attrs["units"] = "deg"
    found = read_tracks(tmp_path / "a.nc")
    np.testing.assert_allclose(found["time"], [0.0, 0.5])
    np.testing.assert_allclose(found["angle"], [0.0, np.pi / 2])
    np.testing.assert_allclose(found["position"], TWO * 1e-3)
    assert [found[name].attrs["units"] for name in ("position", "time", "angle")] == ["m", "s", "rad"]
    with h5py.File(tmp_path / "a.nc", "a") as file:
        file["time"].attrs["units"] = "frames"
    with pytest.raises(InputError, match=r"unit of time: got '1 frames', needs a unit of .s."):
        read_tracks(tmp_path / "a.nc")


def test_pixels_become_metres_by_the_scale_of_each_axis():
    tracks = moving_tracks(attributes={"metres_per_pixel_x": 1e-5, "metres_per_pixel_y": 2e-5})
    metres = tracks_in_metres(tracks)
    assert (metres["position"].attrs["units"], tracks["position"].attrs["units"]) == ("m", "px")
    np.testing.assert_allclose(metres["position"].values, tracks["position"].values * (1e-5, 2e-5))
    assert tracks_in_metres(metres) is metres
    other = tracks_in_metres(tracks, (1e-3, 1e-3))
    np.testing.assert_allclose(other["position"].values, tracks["position"].values * 1e-3)
    with pytest.raises(InputError, match="metres_per_pixel: got"):
        tracks_in_metres(moving_tracks())


def test_a_table_has_a_row_for_each_marker_at_each_time_and_is_read_in_any_order():
    table = tracks_table(moving_tracks())
    assert list(table.columns) == ["time_s", "marker", "x_px", "y_px", "quality", "kind", "ring", "angle_rad"]
    assert len(table) == 5 * 25
    assert table["x_px"].isna().sum() == 1
    assert table.loc[26, ["time_s", "marker"]].tolist() == [pytest.approx(1 / 30), 1]
    tracks = moving_tracks()
    table = tracks_table(tracks).dropna().sample(frac=1.0, random_state=0)
    xr.testing.assert_equal(tracks_from_table(table), tracks)
    bare = tracks_from_table(tracks_table(tracks).drop(columns=["quality", "kind", "ring", "angle_rad"]))
    assert float(bare["quality"].sum()) == 5 * 25 - 1
    assert set(bare["kind"].values) == {"internal"}
    nothing = hide(tracks, 2, slice(None))
    xr.testing.assert_equal(tracks_from_table(tracks_table(nothing)), nothing)


FIRST = "time_s,marker,x_px,y_px,quality\n0.0,0,1.0,2.0,1.0\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, r"a\.csv: cannot be read"),
        ("", r"a\.csv: is no table"),
        ("time_s,marker,x_px\n0.0,0,1.0\n", r"a\.csv: has the columns time_s, marker, x_px, needs time_s"),
        (f"{FIRST}0.0,0,1.0,2.0,1.0", r"a\.csv: marker .* has two rows at 0.0 s"),
        (f"{FIRST}0.1,0,here,2.0,1.0", r"a\.csv: x_px: row 2 has 'here', needs a number; correct that cell"),
        (f"{FIRST}later,0,1.0,2.0,1.0", "time_s: row 2 has 'later'"),
        (f"{FIRST},0,1.0,2.0,1.0", "time_s: row 2 has nothing"),
        (f"{FIRST.splitlines()[0]}\n0,0,0,1,0,2,0,1,0", "has decimal commas, needs commas between columns and points"),
        (f"{FIRST}0.1,,1.0,2.0,1.0", "marker: row 2 has nothing"),
        (f"{FIRST}0.1,0,1.0,2.0,good", "quality: row 2 has 'good'"),
    ],
)
def test_what_is_no_table_of_tracks_is_refused(tmp_path, text, said):
    if text is not None:
        (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ResultError if text is None else InputError, match=said):
        read_tracks_csv(tmp_path / "a.csv")


TIMES = 0.1 * np.arange(4)
POSITION = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 40.0]]) + np.arange(4)[:, None, None] * np.array([1.0, 0.0])
TRUTH = make_tracks(POSITION, TIMES, units="px", kind="external", ring=np.array([0, 1, 1]))


def test_markers_are_matched_and_lost_swapped_and_unseen_ones_count():
    found = make_tracks(POSITION[:, [2, 0, 1]] + 0.1, np.arange(4.0), units="px")
    matched = matched_tracks(found, TRUTH)
    assert matched["position"].values == pytest.approx(POSITION + 0.1)
    assert matched["ring"].values.tolist() == [0, 1, 1]
    errors = track_errors(matched, TRUTH)
    assert (errors.frames, errors.markers, errors.kept, errors.swapped) == (4, 3, 1.0, 0)
    assert (errors.rms, errors.largest) == pytest.approx((0.1, 0.1 * np.sqrt(2.0)))
    position = POSITION.copy()
    position[3, [0, 1]] = position[3, [1, 0]]
    position[1, 2] = np.nan
    found = make_tracks(position, TIMES, units="px")
    errors = track_errors(found, TRUTH)
    assert (errors.swapped, errors.kept) == (2, pytest.approx(9 / 12))
    hidden = POSITION.copy()
    hidden[:, 1] = np.nan
    assert track_errors(found, make_tracks(hidden, TIMES, units="px")).markers == 2
    matched = matched_tracks(make_tracks(np.full((2, 1, 2), np.nan), [0.0, 1.0], units="px"), TRUTH)
    assert np.isnan(matched["position"].values).all()
    errors = track_errors(matched, TRUTH)
    assert (errors.rms, errors.largest, errors.kept) == (None, None, 0.0)
    unseen = np.where(np.arange(3)[:, None] == 2, np.nan, POSITION)
    matched = matched_tracks(TRUTH, make_tracks(unseen, TIMES, units="px"))
    assert np.isnan(matched["position"].values[:, 2]).all(), "what has no truth is no marker of it"


def tracks(position):
    return make_tracks(position, np.arange(len(position)) / 30.0, units="px")


def test_noise_bias_and_losses_are_told_apart():
    random = np.random.default_rng(0)
    truth = random.uniform(0, 100, (500, 80, 2))
    found = truth + 0.03 * random.standard_normal((80, 2)) + 0.01 * random.standard_normal(truth.shape)
    found[random.random((500, 80)) < 0.02] = np.nan
    measured = position_errors(tracks(found), tracks(truth))
    assert measured.noise == pytest.approx(0.01, rel=0.02)
    assert measured.bias == pytest.approx(0.03, rel=0.2)
    assert measured.lost == pytest.approx(0.02, rel=0.1)
    assert abs(measured.correlation) < 0.02
    assert measured.rms == np.hypot(measured.noise, measured.bias)
    white, zeros = np.random.default_rng(0).standard_normal((10, 2000, 2)), tracks(np.zeros((10, 2000, 2)))
    measured = position_errors(tracks(white), zeros)
    assert measured.noise == pytest.approx(1.0, rel=0.02)
    assert measured.bias < 0.1
    assert position_errors(zeros, zeros) == PositionErrors(0.0)
    truth = np.zeros((5, 2, 2))
    truth[:, 1] = np.nan
    assert position_errors(tracks(truth), tracks(truth)).lost == 0.0, "outside the image"


ZEROS, NANS, MOVING = np.zeros((5, 2, 2)), np.full((5, 2, 2), np.nan), moving_tracks()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: check_tracks(MOVING.drop_vars("quality")), "has no 'quality'"),
        (lambda: check_tracks(MOVING.transpose("marker", "time", "axis")), "has the dimensions"),
        (lambda: check_tracks(MOVING.assign(position=MOVING["position"].astype("float32"))), "float32"),
        (lambda: check_tracks(MOVING.assign_coords(axis=["x", "z"])), "axis: got"),
        (lambda: check_tracks(in_units(time="ms")), "time: has the unit 'ms', needs s; convert it"),
        (lambda: check_tracks(in_units(quality="%")), "quality: has the unit '%', needs 1"),
        (lambda: check_tracks(in_units(angle="deg")), "angle: has the unit 'deg', needs rad"),
        (lambda: check_tracks(in_units(marker="mm")), "marker: has the unit 'mm', needs none"),
        (lambda: matched_tracks(TRUTH, TRUTH.isel(time=[0, 1])), "needs at most 2, as the truth has"),
        (lambda: track_errors(TRUTH.isel(marker=[0, 1]), TRUTH), "needs the same times and markers in both"),
        (lambda: position_errors(tracks(ZEROS), tracks(ZEROS[:, :1])), "needs the same times and markers in both"),
        (lambda: position_errors(tracks(NANS), tracks(ZEROS)), "tracks: has no marker in three frames"),
    ],
)
def test_what_is_no_tracks_or_cannot_be_compared_is_refused(call, said):
    with pytest.raises(InputError, match=said):
        call()
