"""Labelled datasets as netCDF-4 files, written by h5py.

Such a file is HDF5 with a dimension scale for every dimension (netCDF Users Guide, appendix on the file format).
General writers look each dimension up by name, again and again, which for the many small variables of a history takes
longer than its data.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["netcdf_bytes"]

# Bytes of equal weight stand side by side ("shuffle"): histories are a seventh smaller and take less time.
_COMPRESSION: Mapping[str, Any] = MappingProxyType({"compression": "gzip", "compression_opts": 1, "shuffle": True})
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable. {:9d}"


def netcdf_bytes(dataset: xr.Dataset, compressed: Iterable[Hashable] = ()) -> bytes:
    """Return the content of a netCDF-4 file.

    Parameters
    ----------
    dataset : xarray.Dataset
        The dataset. Attributes are text, numbers or lists of these.
    compressed : iterable of str, optional
        Names of the variables that are compressed, losslessly.

    Examples
    --------
    >>> import io
    >>> import xarray as xr
    >>> rate = xr.Dataset({"rate": ("time", [1.0, 2.0], {"units": "m/s"})}, coords={"time": [0.0, 0.5]})
    >>> xr.open_dataset(io.BytesIO(netcdf_bytes(rate)), engine="h5netcdf").identical(rate)
    True
    """
    import h5py
    import xarray as xr

    variables, attributes = xr.conventions.cf_encoder(*xr.conventions.encode_dataset_coordinates(dataset))
    chosen = set(compressed)
    with h5py.File("memory", "w", driver="core", backing_store=False, track_order=True) as file:
        _describe(file, {**attributes, "_NCProperties": np.bytes_(f"version=2,h5py={h5py.__version__}")})
        made = {name: _written(file, str(name), own, name in chosen) for name, own in variables.items()}
        scales = _scales(file, dataset.sizes, made)
        for name, own in variables.items():
            if name not in scales:
                for axis, dimension in enumerate(own.dims):
                    made[name].dims[axis].attach_scale(scales[dimension])
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def _written(file: Any, name: str, variable: xr.Variable, compressed: bool) -> Any:
    """Write a variable with its attributes, and return its place in the file."""
    import h5py

    values = np.asarray(variable.values)
    if values.dtype.kind in "UO":
        values = values.astype(h5py.string_dtype())
    options = dict(_COMPRESSION) if compressed and values.ndim else {}
    if 0 in values.shape:
        # A dimension without length is one that may grow.
        options |= {"maxshape": tuple(size or None for size in values.shape), "chunks": True}
    made = file.create_dataset(name, data=values, track_order=True, **options)
    _describe(made, variable.attrs)
    return made


def _scales(file: Any, sizes: Mapping[Hashable, int], made: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
    """Return the dimension scales of all dimensions: the variables of their names, and others without values."""
    scales = {}
    for number, (name, size) in enumerate(sizes.items()):
        if name in made:
            scale, label = made[name], str(name)
        else:
            grows: dict[str, Any] = {} if size else {"maxshape": (None,), "chunks": True}
            scale, label = file.create_dataset(str(name), (size,), ">f4", **grows), _NO_VARIABLE.format(size)
        scale.make_scale(label)
        scale.attrs["_Netcdf4Dimid"] = np.int32(number)
        scales[name] = scale
    return scales


def _describe(place: Any, attributes: Mapping[Any, Any]) -> None:
    """Write attributes of a file or of a variable."""
    import h5py

    for name, value in attributes.items():
        of_text = isinstance(value, (list, tuple)) and all(isinstance(own, str) for own in value)
        place.attrs[str(name)] = np.array(value, dtype=h5py.string_dtype()) if of_text else value
