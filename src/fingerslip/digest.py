"""Hashes that tell inputs, meshes and files apart."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["digest", "file_digest"]


def digest(*parts: Any) -> str:
    """Return the SHA-256 hash of arrays, bytes, text and plain data, in this order.

    Parameters
    ----------
    parts : array, bytes or plain data
        Plain data is what JSON can hold; the order of the keys of a mapping does not matter.

    Examples
    --------
    >>> digest({"a": 1, "b": [2, 3]}) == digest({"b": [2, 3], "a": 1})
    True
    """
    checksum = hashlib.sha256()
    for part in parts:
        checksum.update(_content(part))
    return checksum.hexdigest()


def file_digest(path: Path) -> str:
    """Return the SHA-256 hash of what is in a file; raise OSError where it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _content(part: bytes | NDArray[Any] | Any) -> bytes:
    if isinstance(part, bytes):
        return part
    if isinstance(part, np.ndarray):
        return np.ascontiguousarray(part).tobytes()
    return json.dumps(part, sort_keys=True).encode()
