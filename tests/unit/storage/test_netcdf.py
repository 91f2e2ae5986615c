"""Files of netCDF-4 hold what general writers write: values, attributes, dimensions without values or length."""

import io
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from fingerslip.storage.netcdf import netcdf_bytes, read_netcdf


def dataset(count: int = 3) -> xr.Dataset:
    """Return numbers of all kinds, text, and a dimension without a variable."""
    values = {
        "force": (("time", "place", "axis"), np.arange(2.0 * count * 2).reshape(2, count, 2), {"units": "N"}),
        "state": (("time", "place"), np.ones((2, count), dtype=np.int8)),
        "steps": (("time",), np.arange(2, dtype=np.int32)),
        "lost": (("time",), np.array([np.nan, 1.0], dtype=np.float32)),
        "total": ((), 3.5),
    }
    coordinates = {
        "time": ("time", [0.0, 0.5], {"units": "s", "long_name": "time"}),
        "place": ("place", np.array([f"ä{number}" for number in range(count)], dtype="U4")),
        "kind": ("place", np.array([""] * count, dtype="U1")),
    }
    return xr.Dataset(values, coords=coordinates, attrs={"title": "härte", "n": 3, "share": 0.25, "names": ["a", "b"]})


def read(content: bytes) -> xr.Dataset:
    return xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_timedelta=False).load()


@pytest.mark.parametrize("count", [3, 0])
def test_a_dataset_is_read_back_as_from_a_general_writer(count: int) -> None:
    given = dataset(count)
    found = read(netcdf_bytes(given, ["force", "total"]))
    expected = read(bytes(given.to_netcdf(engine="h5netcdf")))
    xr.testing.assert_identical(found, expected)
    assert list(found.variables) == list(expected.variables)
    assert {name: own.dtype for name, own in found.variables.items()} == {
        name: own.dtype for name, own in expected.variables.items()
    }


def test_chosen_variables_are_compressed_and_dimensions_have_scales() -> None:
    with h5py.File(io.BytesIO(netcdf_bytes(dataset(), ["force"]))) as file:
        assert (file["force"].compression, file["state"].compression) == ("gzip", None)
        assert [own[0].name for own in file["force"].dims] == ["/time", "/place", "/axis"]
        assert file["axis"].attrs["NAME"].startswith(b"This is a netCDF dimension but not a netCDF variable")
        assert file["axis"].shape == (2,)
        assert sorted(int(file[name].attrs["_Netcdf4Dimid"]) for name in ("time", "place", "axis")) == [0, 1, 2]


@pytest.mark.parametrize("count", [3, 0])
@pytest.mark.parametrize("ours", [True, False])
def test_files_of_any_writer_are_read_as_a_general_reader_does(tmp_path: Path, count: int, ours: bool) -> None:
    given = dataset(count)
    content = netcdf_bytes(given, ["force"]) if ours else bytes(given.to_netcdf(engine="h5netcdf"))
    (tmp_path / "given.nc").write_bytes(content)
    found, expected = read_netcdf(tmp_path / "given.nc"), read(content)
    xr.testing.assert_identical(found, expected)
    assert list(found.variables) == list(expected.variables)
    assert {name: own.dtype for name, own in found.variables.items()} == {
        name: own.dtype for name, own in expected.variables.items()
    }
    assert {name: type(own) for name, own in found.attrs.items()} == {
        name: type(own) for name, own in expected.attrs.items()
    }


def test_what_is_read_can_be_written_again(tmp_path: Path) -> None:
    (tmp_path / "given.nc").write_bytes(netcdf_bytes(dataset()))
    once = read_netcdf(tmp_path / "given.nc")
    (tmp_path / "again.nc").write_bytes(netcdf_bytes(once))
    xr.testing.assert_identical(read_netcdf(tmp_path / "again.nc"), once)
