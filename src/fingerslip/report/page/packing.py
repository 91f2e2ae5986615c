"""Arrays in a page: compressed together, as text that the page's script unpacks."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["pack_arrays", "quantise", "unpack_arrays"]

# Types that a browser has arrays of, by their names in NumPy.
_TYPES = ("u1", "i2", "u2", "u4", "f4")


def pack_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return arrays as plain data: their types, shapes and places, and all of their bytes compressed, in base 64."""
    header, parts, at = {}, [], 0
    for name, array in arrays.items():
        kind = array.dtype.str[1:]
        assert kind in _TYPES, f"{name} has the type {kind}"
        data = np.ascontiguousarray(array, dtype=f"<{kind}").tobytes()
        # Browsers read arrays at multiples of the size of their numbers only.
        data += b"\0" * (-len(data) % 4)
        header[name] = {"type": kind, "shape": list(array.shape), "at": at}
        parts.append(data)
        at += len(data)
    return {"arrays": header, "data": base64.b64encode(zlib.compress(b"".join(parts), 9)).decode("ascii")}


def unpack_arrays(values: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the arrays of :func:`pack_arrays`."""
    data = zlib.decompress(base64.b64decode(values["data"]))
    return {
        name: np.frombuffer(data, f"<{own['type']}", int(np.prod(own["shape"])), own["at"]).reshape(own["shape"])
        for name, own in values["arrays"].items()
    }


def quantise(values: NDArray[np.float64]) -> tuple[NDArray[np.int16], float]:
    """Return numbers as whole multiples of a unit, and the unit: the largest has 32,000."""
    unit = float(np.abs(values).max(initial=0.0)) / 32000.0 or 1.0
    return np.round(values / unit).astype(np.int16), unit
