"""States as plain data and arrays, so that they can be written to a file and made again, to the last bit.

Only frozen data of this package is packed: dataclasses, arrays, sparse matrices and what JSON holds. Arrays that two
fields share are kept once, and shared again.
"""

from __future__ import annotations

import dataclasses
import importlib
import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.errors import DamagedError
from fingerslip.storage.files import write_bytes

_TREE, _PACKAGE = "tree.json", "fingerslip."
_REPAIR = "save the simulation again"


def write_archive(path: Path, value: Any, outside: Mapping[str, NDArray[Any]]) -> None:
    """Write a value to a file, whole or not at all."""
    arrays: dict[str, NDArray[Any]] = {}
    names = {id(array): name for name, array in outside.items()}
    tree, memory = json.dumps(_pack(value, arrays, names)), io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_STORED) as file:
        file.writestr(_TREE, tree)
        for name, array in arrays.items():
            with file.open(name, "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
    write_bytes(path, memory.getvalue())


def read_archive(path: Path, outside: Mapping[str, NDArray[Any]]) -> Any:
    """Return the value that was written to a file."""
    try:
        with zipfile.ZipFile(path) as file:
            # What is written is not compressed.
            if sum(entry.file_size for entry in file.infolist()) > path.stat().st_size:
                raise ValueError("unpacks to more than itself")  # noqa: TRY301
            arrays = {name: np.load(file.open(name), allow_pickle=False) for name in file.namelist() if name != _TREE}
            tree = json.loads(file.read(_TREE))
        return _unpack(tree, {**arrays, **outside})
    except FileNotFoundError:
        raise DamagedError(str(path), "is not there", "check the name") from None
    # Readers of numbers and text, and the classes that are made, fail in any way on what others have written.
    except Exception as error:
        raise DamagedError(str(path), "holds no saved simulation, or is damaged", _REPAIR) from error


def is_like(value: Any, pattern: Any) -> bool:
    """Tell whether a value has the types, keys and shapes of a pattern; where the pattern is None, all are right."""
    if isinstance(pattern, np.ndarray):
        return isinstance(value, np.ndarray) and (value.dtype, value.shape) == (pattern.dtype, pattern.shape)
    if isinstance(pattern, int | float):
        return isinstance(value, int | float)
    if pattern is None or type(value) is not type(pattern):
        return pattern is None
    members, others = _members(value), _members(pattern)
    return members.keys() == others.keys() and all(is_like(members[name], others[name]) for name in others)


def _members(value: Any) -> Mapping[Any, Any]:
    if isinstance(value, Mapping):
        return value
    if dataclasses.is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return dict(enumerate(value)) if isinstance(value, tuple | list) else {}


def _pack(value: Any, arrays: dict[str, NDArray[Any]], names: dict[int, str]) -> Any:
    if value is None or isinstance(value, bool | int | float | str | np.generic):
        return {"value": value.item() if isinstance(value, np.generic) else value}
    if isinstance(value, np.ndarray):
        if id(value) not in names:
            names[id(value)] = f"{len(arrays)}.npy"
            arrays[names[id(value)]] = value
        return {"array": names[id(value)]}
    if isinstance(value, tuple | list):
        kind = "tuple" if isinstance(value, tuple) else "list"
        return {kind: [_pack(item, arrays, names) for item in value]}
    if isinstance(value, Mapping):
        return {"mapping": {str(name): _pack(item, arrays, names) for name, item in value.items()}}
    if sparse.issparse(value):
        of_matrix = (*map(np.asarray, (value.data, value.indices, value.indptr)), list(value.shape))
        return {"csr": [_pack(part, arrays, names) for part in of_matrix]}
    if dataclasses.is_dataclass(value) and type(value).__module__.startswith(_PACKAGE):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
        mark = f"{type(value).__module__}:{type(value).__qualname__}"
        return {"of": mark, "fields": {name: _pack(item, arrays, names) for name, item in fields.items()}}
    raise TypeError(f"cannot save a {type(value).__name__}")


def _unpack(tree: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    match tree:
        case {"value": value}:
            return value
        case {"array": name}:
            return arrays[name]
        case {"tuple": items} | {"list": items}:
            items_unpacked = [_unpack(item, arrays) for item in items]
            return items_unpacked if "list" in tree else tuple(items_unpacked)
        case {"mapping": items}:
            return {name: _unpack(item, arrays) for name, item in items.items()}
        case {"csr": items}:
            data, indices, starts, shape = (_unpack(item, arrays) for item in items)
            return sparse.csr_matrix((data, indices, starts), shape=tuple(shape))
        case {"of": mark, "fields": fields}:
            return _kind(mark)(**{name: _unpack(field, arrays) for name, field in fields.items()})
    raise ValueError(f"unknown: {tree}")


def _kind(mark: str) -> type:
    """Return the dataclass of a mark; only those of this package are ever made."""
    module, _, name = mark.partition(":")
    if not module.startswith(_PACKAGE):
        raise ValueError(f"not of this package: {mark}")
    kind = getattr(importlib.import_module(module), name)
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise ValueError(f"no dataclass: {mark}")
    return kind
