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


def test_chosen_variables_are_compressed_and_dimensions_have_scales() -> None:
    with h5py.File(io.BytesIO(netcdf_bytes(dataset(), ["force"]))) as file:
        assert (file["force"].compression, file["state"].compression) == ("gzip", None)
        assert [own[0].name for own in file["force"].dims] == ["/time", "/place", "/axis"]
        assert file["axis"].attrs["NAME"].startswith(b"This is a netCDF dimension but not a netCDF variable")
        assert file["axis"].shape == (2,)
        assert sorted(int(file[name].attrs["_Netcdf4Dimid"]) for name in ("time", "place", "axis")) == [0, 1, 2]


@pytest.mark.parametrize("count", [3, 0])
def test_files_are_what_a_general_writer_writes_and_are_read_as_a_general_reader_does(
    tmp_path: Path, count: int
) -> None:
    given = dataset(count)
    ours, theirs = netcdf_bytes(given, ["force", "total"]), bytes(given.to_netcdf(engine="h5netcdf"))
    expected = read(theirs)
    for content in (ours, theirs):
        (tmp_path / "given.nc").write_bytes(content)
        for found in (read(content), read_netcdf(tmp_path / "given.nc")):
            xr.testing.assert_identical(found, expected)
            kinds = [(name, variable.dtype) for name, variable in found.variables.items()]
            assert kinds == [(name, variable.dtype) for name, variable in expected.variables.items()]
            assert [*map(type, found.attrs.values())] == [*map(type, read(content).attrs.values())]
    (tmp_path / "given.nc").write_bytes(ours)
    once = read_netcdf(tmp_path / "given.nc")
    (tmp_path / "again.nc").write_bytes(netcdf_bytes(once))
    xr.testing.assert_identical(read_netcdf(tmp_path / "again.nc"), once)
