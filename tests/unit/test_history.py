"""Histories come back from files bit by bit, or the failure is one clear error."""

import contextlib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip import history as records
from problems.pushed import push_and_slide
from unit import synthetic


@pytest.fixture(scope="module")
def history():
    sites = (fs.Site("a", "FA-I", (0.0, 1e-3)),)
    return fs.simulate(push_and_slide(record=fs.Recording(sites, snapshots_every=0.1)))


@pytest.mark.slow
def test_round_trip_through_netcdf_keeps_every_bit_also_without_sites_and_contacts(history, tmp_path):
    path = tmp_path / "history.nc"
    fs.write_history(history, path)
    back = fs.read_history(tmp_path)
    xr.testing.assert_identical(back.drop_attrs(), history.drop_attrs())
    assert set(back.coords) == set(history.coords)
    for name in records.VARIABLES:
        assert back[name].dtype == history[name].dtype
        assert back[name].attrs == history[name].attrs
    for name, value in history.attrs.items():
        np.testing.assert_array_equal(back.attrs[name], value)
    assert [entry.name for entry in tmp_path.iterdir()] == ["history.nc"]
    time = fs.TimeStepping(5e-3, end=0.05)
    plain = fs.simulate(push_and_slide(contacts=(), programme=(), tractions={"left": (5.0, 0.0)}, time=time))
    fs.write_history(plain, tmp_path / "h.nc")
    xr.testing.assert_identical(fs.read_history(tmp_path / "h.nc").drop_attrs(), plain.drop_attrs())


def test_a_failed_write_leaves_the_old_file_and_names_that_no_history_has_are_refused(history, tmp_path, monkeypatch):
    path = tmp_path / "history.nc"
    path.write_bytes(b"old")

    def full_disk(self, data):
        with self.open("wb") as file:
            file.write(b"half of it")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(fs.ResultError, match=r"history.nc: cannot be written .*No space left.*; free some space"):
        fs.write_history(history, path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["history.nc"]
    assert path.read_bytes() == b"old"
    with pytest.raises(KeyError, match="pressure"):
        records.make_history({"pressure": np.zeros(3)}, {})
    with pytest.raises(fs.ResultError, match="cannot be written"):
        fs.write_history(history, tmp_path / "missing" / "history.nc")


OTHER = xr.Dataset({"x": ("n", np.zeros(3))})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda *_: None, r"other.nc: cannot be read as a history .*; run the study again"),
        (lambda _, path: path.write_text("no netCDF at all"), "cannot be read as a history"),
        (lambda _, path: OTHER.to_netcdf(path, engine="h5netcdf"), "is no history"),
        (lambda whole, path: [fs.write_history(whole, path), path.write_bytes(path.read_bytes()[:1000])], ""),
        (
            lambda whole, path: fs.write_history(whole.drop_vars("snapshot_displacement"), path),
            r"other.nc: is no history \(it has no snapshot_displacement\)",
        ),
    ],
)
def test_a_file_that_is_missing_damaged_or_another_is_a_result_error(history, tmp_path, make, message):
    make(history, tmp_path / "other.nc")
    with pytest.raises(fs.ResultError, match=message or None):
        fs.read_history(tmp_path / "other.nc")


def test_times_of_phases_and_the_nearest_record_and_snapshot_are_found(history):
    assert records.phase_times(history, "slide") == [(pytest.approx(0.12), pytest.approx(0.22))]
    assert records.phase_times(history, "lift") == []
    even = synthetic.make(synthetic.Process(step=5e-3))
    assert (records.nearest_record(even, 0.0126), records.nearest_record(even, 99.0)) == (3, even.sizes["time"] - 1)
    shown = even.assign_coords(snapshot_time=("snapshot_time", [0.0, 0.5, 2.0]))
    assert [records.nearest_snapshot(shown, time) for time in (None, 0.0, 0.3, 9.0)] == [2, 0, 1, 2]


def test_sites_are_found_by_kind_and_by_name_and_dimensions_are_told_apart():
    history = synthetic.make(synthetic.Process())
    kinds = records.site_kinds(history)
    rows = records.sites_of_kinds(history, ["SA-I", "FA-II"])
    assert set(kinds[rows]) == {"SA-I", "FA-II"}
    assert len(rows) == 50
    assert (np.diff(rows) > 0).all()
    assert records.site_rows(history, history["site"].values[[7, 3]].tolist()).tolist() == [7, 3]
    with pytest.raises(KeyError, match="nowhere"):
        records.site_rows(history, ["nowhere"])
    bare = history.drop_dims("site")
    assert (
        records.site_kinds(bare).size
        == records.sites_of_kinds(bare, ["SA-I"]).size
        == records.site_rows(bare, []).size
        == 0
    )
    assert not records.is_solid(history)
    assert records.is_solid(history.drop_dims("component").assign_coords(component=["x", "y", "z"]))


@pytest.mark.parametrize("seed", range(8))
def test_a_damaged_file_is_no_history(tmp_path, seed):
    path = tmp_path / "h.nc"
    fs.write_history(synthetic.make(synthetic.Process()), path)
    content = bytearray(path.read_bytes())
    start = seed * len(content) // 8
    content[start : start + 600] = bytes(600)
    path.write_bytes(bytes(content))
    with contextlib.suppress(fs.ResultError):  # damage may lie in what nothing reads
        fs.read_history(path)
