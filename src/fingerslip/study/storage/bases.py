"""Reduced bases on disk, in the results of a study: made once for each body, whatever run needs it first."""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import ResultError
from fingerslip.storage.files import alone, digest, write_bytes, writing

__all__ = ["BasisFolder"]

Array = NDArray[np.float64]

_CHECKSUM = 64
# Bases that are kept: those of the bodies of one sweep. One of the paper's fingertip in 3D takes 0.5 GB.
_KEPT = 8

_logger = logging.getLogger("fingerslip.study")


@dataclass(frozen=True)
class BasisFolder:
    """A folder of bases: a :class:`fingerslip.dynamics.reduced.march.BasisStore`.

    Each file is the checksum of its arrays, then the arrays in NumPy's format. It has the key as its name.
    """

    folder: Path  # the folder, which is made when the first basis is kept

    def load(self, key: str) -> Mapping[str, Array] | None:
        """Return the arrays of a basis; None where there is none, or where its file is damaged, which the log says."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            _say_made_again(path, error.strerror or str(error))
            return None
        if content[:_CHECKSUM] != digest(content[_CHECKSUM:]).encode():
            _say_made_again(path, "its checksum is another")
            return None
        with np.load(io.BytesIO(content[_CHECKSUM:]), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}

    def save(self, key: str, arrays: Mapping[str, Array]) -> None:
        """Keep the arrays of a basis and remove the oldest of too many; the log says where that is not possible."""
        file = io.BytesIO()
        np.savez(file, **arrays)  # type: ignore[arg-type]
        content = file.getvalue()
        try:
            with writing(self.folder):
                self.folder.mkdir(parents=True, exist_ok=True)
                write_bytes(self._path(key), digest(content).encode() + content)
                for old in sorted(self.folder.glob("*.basis"), key=lambda path: path.stat().st_mtime)[:-_KEPT]:
                    old.unlink(missing_ok=True)
        except ResultError as error:
            _logger.warning("the basis is not kept: %s", error)

    def alone(self, key: str) -> AbstractContextManager[None]:
        """Let one process at a time into a block that looks for a basis and makes it where there is none."""
        return alone(self.folder / f".{key}.lock")

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.basis"


def _say_made_again(path: Path, reason: str) -> None:
    _logger.warning("%s: cannot be used (%s); the basis is made again", path, reason)
