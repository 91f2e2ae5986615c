"""Finished parts of a long evaluation, kept until the whole is there: what was interrupted goes on where it stopped."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial as partial_of
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.optional import optional
from fingerslip.digest import digest
from fingerslip.files import check_folder, clean_stale, new_file, writing
from fingerslip.version import __version__

__all__ = ["Parts", "parts_beside"]

Arrays = dict[str, NDArray[Any]]

_FORMAT = 1
_CHECKSUM = "checksum"
# Arrays alone are written, so that reading them runs nothing.
_save: Callable[..., None] = partial_of(np.savez, allow_pickle=False)


@dataclass(frozen=True)
class Parts:
    """Where finished parts are kept: a file for each, named by what it was computed from."""

    folder: Path | None = None  # the folder, made with the first part
    inputs: str = ""  # hash of the data and of the options that all parts share

    def kept(self, name: str, inputs: Any) -> Arrays | None:
        """Return a part that is there, undamaged and of the same inputs; else None.

        Parameters
        ----------
        name : str
            What the part is, in letters that a file name may have.
        inputs : plain data
            What it is computed from, beside what all parts share.
        """
        return None if self.folder is None else _load_part(self._file(self.folder, name, inputs))

    def keep(self, name: str, inputs: Any, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a part, whole or not at all; raise ResultError where it cannot be written."""
        if self.folder is None:
            return
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        with new_file(self._file(self.folder, name, inputs)) as partial:
            _save(partial, **{_CHECKSUM: np.array(_checksum(arrays))}, **arrays)

    def part(self, name: str, inputs: Any, make: Callable[[], Mapping[str, NDArray[Any]]]) -> Arrays:
        """Return a part: the one that is kept, or else a new one, which is then kept."""
        arrays = self.kept(name, inputs)
        if arrays is None:
            arrays = dict(make())
            self.keep(name, inputs, arrays)
        return arrays

    def remove(self) -> None:
        """Remove all parts: the whole is there."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, folder: Path, name: str, inputs: Any) -> Path:
        versions = (_FORMAT, __version__, str(optional("sklearn").__version__))
        return folder / f"{name}-{digest(versions, self.inputs, name, inputs)[:20]}.npz"


def parts_beside(output: Path | None, *inputs: Any) -> Parts:
    """Return the parts of what is to be written to a folder: they are in ``OUTPUT.unfinished``."""
    if output is None:
        return Parts()
    check_folder(output)
    folder = output.with_name(f"{output.name}.unfinished")
    clean_stale(folder)
    return Parts(folder, digest(*inputs))


def _load_part(path: Path) -> Arrays | None:
    """Read a part; one that is damaged counts as none, and is computed again."""
    try:
        # numpy itself leaves a file open that is no whole archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays: Arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None
    checksum = arrays.pop(_CHECKSUM, None)
    return arrays if checksum is not None and str(checksum) == _checksum(arrays) else None


def _checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    described = [[name, str(array.dtype), list(array.shape)] for name, array in sorted(arrays.items())]
    return digest(described, *(array for _, array in sorted(arrays.items())))
