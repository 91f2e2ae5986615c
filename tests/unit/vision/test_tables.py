"""Tables of tracks are tidy, and tracks come back from them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError, ResultError
from fingerslip.vision.tables import read_tracks_csv, tracks_from_table, tracks_table, write_tracks_csv
from unit.vision.synthetic import moving_tracks


def test_a_row_for_each_marker_at_each_time():
    table = tracks_table(moving_tracks())
    assert list(table.columns) == ["time_s", "marker", "x_px", "y_px", "quality", "kind", "ring", "angle_rad"]
    assert len(table) == 5 * 25
    assert table["x_px"].isna().sum() == 1
    assert table.loc[26, ["time_s", "marker"]].tolist() == [pytest.approx(1 / 30), 1]


@pytest.mark.parametrize(("units", "dim"), [("px", 2), ("m", 3)])
def test_round_trip_through_csv_keeps_every_bit(tmp_path, units, dim):
    tracks = moving_tracks(units=units, dim=dim)
    write_tracks_csv(tracks, tmp_path / "tracks.csv")
    xr.testing.assert_identical(read_tracks_csv(tmp_path / "tracks.csv"), tracks)


def test_rows_in_any_order_and_missing_ones_are_read():
    tracks = moving_tracks()
    table = tracks_table(tracks).dropna().sample(frac=1.0, random_state=0)
    xr.testing.assert_equal(tracks_from_table(table), tracks)


def test_quality_and_kind_may_be_missing():
    table = tracks_table(moving_tracks()).drop(columns=["quality", "kind", "ring", "angle_rad"])
    tracks = tracks_from_table(table)
    assert float(tracks["quality"].sum()) == 5 * 25 - 1
    assert set(tracks["kind"].values) == {"internal"}


def test_a_time_at_which_nothing_was_seen_is_kept():
    tracks = moving_tracks()
    tracks["position"].values[2] = np.nan
    tracks["quality"].values[2] = 0.0
    xr.testing.assert_equal(tracks_from_table(tracks_table(tracks)), tracks)


def test_what_is_no_table_of_tracks_is_refused(tmp_path):
    table = tracks_table(moving_tracks())
    with pytest.raises(InputError, match="table: has the columns"):
        tracks_from_table(table.drop(columns="y_px"))
    with pytest.raises(InputError, match=r"has two rows at 0.0 s"):
        tracks_from_table(table.assign(marker=3))
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(InputError, match=r"empty.csv: is no table"):
        read_tracks_csv(tmp_path / "empty.csv")
    with pytest.raises(ResultError, match="cannot be read"):
        read_tracks_csv(tmp_path / "missing.csv")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("0.1,0,here,2.0,1.0", "x_px: row 2 has 'here', needs a number; correct that cell"),
        ("later,0,1.0,2.0,1.0", "time_s: row 2 has 'later'"),
        (",0,1.0,2.0,1.0", "time_s: row 2 has nothing"),
        ("0.1,,1.0,2.0,1.0", "marker: row 2 has nothing"),
        ("0.1,0,1.0,2.0,good", "quality: row 2 has 'good'"),
    ],
)
def test_a_word_where_a_number_is_due_is_named(tmp_path, line, said):
    (tmp_path / "a.csv").write_text(f"time_s,marker,x_px,y_px,quality\n0.0,0,1.0,2.0,1.0\n{line}\n")
    with pytest.raises(InputError, match=rf"a\.csv: {said}"):
        read_tracks_csv(tmp_path / "a.csv")
