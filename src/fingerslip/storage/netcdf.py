"""Labelled datasets as netCDF-4 files, written and read by h5py.

Such a file is HDF5 with a dimension scale for every dimension (netCDF Users Guide, appendix on the file format).
General writers and readers look each dimension up by name, again and again, which for the many small variables of a
history takes longer than its data.
"""

from __future__ import annotations

import functools
import pickle
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import ResultError, shorten
from fingerslip.libraries import xr

# Bytes of equal weight stand side by side ("shuffle"): histories are a seventh smaller and take less time.
_COMPRESSION: Mapping[str, Any] = MappingProxyType({"compression": "gzip", "compression_opts": 1, "shuffle": True})
# Opens an image for writing, in the HDF5 library.
_WRITABLE = 1
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable. {:9d}"
# Attributes with which HDF5 and netCDF-4 describe dimensions and files.
_OF_THE_FORMAT = frozenset(
    {"CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates", "_NCProperties"}
)


def netcdf_bytes(dataset: xr.Dataset, compressed: Iterable[Hashable] = ()) -> bytes:
    """Return the content of a netCDF-4 file.

    Examples
    --------
    >>> import io
    >>> import xarray as xr
    >>> rate = xr.Dataset({"rate": ("time", [1.0, 2.0], {"units": "m/s"})}, coords={"time": [0.0, 0.5]})
    >>> xr.open_dataset(io.BytesIO(netcdf_bytes(rate)), engine="h5netcdf").identical(rate)
    True
    """
    import h5py

    chosen, outlines = set(compressed), []
    values = {str(name): np.asarray(variable.values) for name, variable in dataset.variables.items()}
    described = {name: (item.dims, item.dtype, item.attrs) for name, item in dataset.variables.items()}
    # Runs of a sweep differ in their numbers alone.
    named, attributes = _encoded_attributes(pickle.dumps((described, set(dataset.coords))))
    for name, (dims, dtype, _) in described.items():
        array = values[str(name)]
        text = array if _is_text(dtype) else None
        outlines.append(_Outline(str(name), dims, array.shape, array.dtype, named[name], name in chosen, text))
    attributes = {**dataset.attrs, **attributes}
    empty = _empty_file(pickle.dumps((outlines, dict(dataset.sizes))))
    with h5py.File(h5py.h5f.open_file_image(empty, flags=_WRITABLE)) as file:
        _describe(file, {**attributes, "_NCProperties": np.bytes_(f"version=2,h5py={h5py.__version__}")})
        for name, value in values.items():
            if value.size and not _is_text(value.dtype):
                h5py.h5d.open(file.id, name.encode()).write(h5py.h5s.ALL, h5py.h5s.ALL, np.ascontiguousarray(value))
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def read_netcdf(path: str | Path, what: str = "netCDF", repair: str = "make it again") -> xr.Dataset:
    """Read a netCDF-4 file without groups, with arrays in memory; errors say what it should be, and how to mend it."""
    try:
        return _read(path)
    # The readers of HDF5 fail in any way on a damaged file.
    except Exception as error:
        cause = shorten(str(error)) or type(error).__name__
        raise ResultError(f"{path}: cannot be read as {what} ({cause}); {repair}") from error


def _read(path: str | Path) -> xr.Dataset:
    import h5py

    with h5py.File(path, "r") as file:
        mark = _NO_VARIABLE.partition("{")[0].encode()  # of what only says how long a dimension is
        places = {name: item for name, item in file.items() if not bytes(item.attrs.get("NAME", b"")).startswith(mark)}
        stored = {name: _variable_in_file(file, name, item) for name, item in places.items()}
        attributes = _attributes_of(file)
    variables, selected, coordinates = xr.conventions.decode_cf_variables(stored, attributes, decode_times=False)
    return xr.Dataset(variables, attrs=selected).set_coords(coordinates).load()


@functools.lru_cache(maxsize=8)
def _encoded_attributes(pickled: bytes) -> tuple[Mapping[Hashable, Mapping[Any, Any]], Mapping[Any, Any]]:
    """Return what attributes variables of numbers and text have in a file, and the file by them."""
    described, coordinates = pickle.loads(pickled)
    empty = {
        name: xr.Variable(dims, np.empty((0,) * len(dims), dtype), attrs)
        for name, (dims, dtype, attrs) in described.items()
    }
    dataset = xr.Dataset(empty).set_coords(coordinates)
    variables, attributes = xr.conventions.cf_encoder(*xr.conventions.encode_dataset_coordinates(dataset))
    return {name: dict(variable.attrs) for name, variable in variables.items()}, attributes


@dataclass(frozen=True)
class _Outline:
    """A variable without its values, but for text."""

    name: str
    dims: tuple[Hashable, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    attributes: Mapping[Any, Any]
    compressed: bool
    text: NDArray[Any] | None


@functools.lru_cache(maxsize=8)
def _empty_file(pickled: bytes) -> bytes:
    """Return a file of outlines with text and all that describes them, but without numbers.

    It is most of the work on a small file.
    """
    import h5py

    outlines, sizes = pickle.loads(pickled)
    with h5py.File("memory", "w", driver="core", backing_store=False, track_order=True) as file:
        datasets = {outline.name: _make_variable(file, outline) for outline in outlines}
        scales = _scales(file, sizes, datasets)
        for element in outlines:
            if element.name not in scales:
                for axis, dimension in enumerate(element.dims):
                    datasets[element.name].dims[axis].attach_scale(scales[dimension])
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def _make_variable(file: Any, outline: _Outline) -> Any:
    """Make the place of a variable, with its attributes and its text."""
    import h5py

    dtype = outline.dtype if outline.text is None else h5py.string_dtype()
    options = dict(_COMPRESSION) if outline.compressed and outline.shape else {}
    if 0 in outline.shape:
        # A dimension without length is one that may grow.
        options |= {"maxshape": tuple(size or None for size in outline.shape), "chunks": True}
    dataset = file.create_dataset(outline.name, outline.shape, dtype, track_order=True, **options)
    _describe(dataset, outline.attributes)
    if outline.text is not None:
        dataset[...] = outline.text.astype(dtype)
    return dataset


def _is_text(dtype: np.dtype[Any]) -> bool:
    return dtype.kind in "UO"


def _scales(file: Any, sizes: Mapping[Hashable, int], datasets: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
    """Return the dimension scales of all dimensions: the variables of their names, and others without values."""
    scales = {}
    for number, (name, size) in enumerate(sizes.items()):
        if name in datasets:
            scale, label = datasets[name], str(name)
        else:
            grows: dict[str, Any] = {} if size else {"maxshape": (None,), "chunks": True}
            scale, label = file.create_dataset(str(name), (size,), ">f4", **grows), _NO_VARIABLE.format(size)
        scale.make_scale(label)
        scale.attrs["_Netcdf4Dimid"] = np.int32(number)
        scales[name] = scale
    return scales


def _describe(owner: Any, attributes: Mapping[Any, Any]) -> None:
    """Write attributes of a file or of a variable."""
    import h5py

    for name, value in attributes.items():
        of_text = isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value)
        owner.attrs[str(name)] = np.array(value, dtype=h5py.string_dtype()) if of_text else value


def _variable_in_file(file: Any, name: str, dataset: Any) -> xr.Variable:
    """Return a variable as it stands in the file."""
    import h5py

    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    values = np.asarray(dataset.asstr()[()]).astype(str) if is_text else dataset[()]
    references = dataset.attrs.get("DIMENSION_LIST")
    if references is None:
        dimensions: tuple[str, ...] = (name,) if dataset.ndim else ()
    else:
        names = (h5py.h5r.get_name(reference[0], file.id) for reference in references)
        dimensions = tuple(name.decode().removeprefix("/") for name in names)
    return xr.Variable(dimensions, values, _attributes_of(dataset))


def _attributes_of(owner: Any) -> dict[str, Any]:
    """Return the attributes of a file or of a variable."""
    return {name: _plain(owner.attrs[name]) for name in owner.attrs if name not in _OF_THE_FORMAT}


def _plain(value: Any) -> Any:
    """Return the value of an attribute: of several an array or a list of texts, of one itself."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        value = [item.decode() if isinstance(item, bytes) else item for item in value]
    elif isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    return value
