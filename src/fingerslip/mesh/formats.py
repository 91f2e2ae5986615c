"""Files in any format that meshio knows, read and written without its messages, and decks of solvers."""

from __future__ import annotations

import contextlib
import functools
import io
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.errors import MeshError, shorten
from fingerslip.mesh.decks.abaqus import read_abaqus
from fingerslip.mesh.decks.deck import Deck
from fingerslip.mesh.decks.febio import read_febio
from fingerslip.mesh.mixed import turn_prisms
from fingerslip.storage.files import new_files

if TYPE_CHECKING:
    import meshio

_AGAIN = "look whether it is whole, and export it again"
# Beyond it squares lose the size of the cells.
_FARTHEST = 1e9
# How often in a row a reader may ask for what comes after the end of its file.
_ENDS = 1000
_VTK = (".vtu", ".vtk")
# What meshio has to be told of some formats.
_OPTIONS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {".msh": MappingProxyType({"file_format": "gmsh22"}), ".stl": MappingProxyType({"binary": True})}
)
# Decks that meshio knows nothing of, or little.
_READERS: Mapping[str, Callable[[Path], Deck]] = MappingProxyType({".inp": read_abaqus, ".feb": read_febio})


def read_file(file: Path, needed: str) -> Deck:
    """Read points, cells and their named groups, with what else a file tells; only decks of solvers tell more."""
    if not file.is_file():
        raise MeshError(str(file), "no such file", needed)
    if not file.stat().st_size:
        raise MeshError(str(file), "is empty", needed, _AGAIN)
    if file.suffix.lower() in _READERS:
        deck = _READERS[file.suffix.lower()](file)
    else:
        try:
            with _silence():
                deck = Deck(_guarded_meshio().read(file))
        # meshio ends the program where no reader fits, and its readers fail in any way on a damaged file.
        except (Exception, SystemExit) as error:
            cause = str(error) if isinstance(error, Exception) else "unknown or damaged format"
            raise MeshError(str(file), f"cannot be read ({shorten(cause)})", needed, _AGAIN) from error
    _check_numbers(file, deck.data)
    if file.suffix.lower() in _VTK:
        turn_prisms(deck.data, -1)
    return deck


def write_file(file: Path, data: meshio.Mesh, suffixes: str) -> None:
    """Write a file, whole or not at all, in the format that its suffix names.

    ``.msh`` is Gmsh's of version 2.2, ``.stl`` is binary.
    """
    import meshio

    if not file.parent.is_dir():
        raise MeshError(str(file), "the folder does not exist", "needs an existing folder")
    if file.suffix in _VTK:
        turn_prisms(data, 1)
    try:
        with _silence(), new_files(file) as partial:
            meshio.write(partial, data, **_OPTIONS.get(file.suffix, {}))
    except (meshio.ReadError, meshio.WriteError, KeyError) as error:
        raise MeshError(str(file), f"cannot be written ({error})", f"needs a suffix such as {suffixes}") from error


@functools.cache
def _guarded_meshio() -> Any:
    """Return meshio, mended for the whole process: its readers loop for ever at the end of a file that is cut off.

    Its modules open files that refuse to end again and again, and its pattern of WKT has one way to match a text.
    """
    import meshio

    for name in [name for name in sys.modules if name.startswith("meshio.")]:
        vars(sys.modules[name])["open"] = _open
    wkt = sys.modules["meshio.wkt._wkt"]
    pattern = wkt.tin_pattern.replace(wkt.float_pattern, r"[+-]?(?:\d++\.?\d*+|\.\d++)").replace(",?)*", ",?)*+")
    vars(wkt)["tin_re"] = re.compile(pattern)
    return meshio


@contextlib.contextmanager
def _open(path: str | Path, mode: str = "r") -> Iterator[Any]:
    with open(path, mode) as file:  # noqa: PTH123  in place of the builtin
        yield _EndingFile(file) if "r" in mode else file


class _EndingFile:
    """A file, open for reading, that fails when it has been asked too often for what comes after its end."""

    def __init__(self, file: Any) -> None:
        self._file, self._ends = file, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._file)

    def read(self, *size: int) -> Any:
        return self._count(self._file.read(*size))

    def readline(self, *size: int) -> Any:
        return self._count(self._file.readline(*size))

    def _count(self, content: Any) -> Any:
        self._ends = 0 if content else self._ends + 1
        if self._ends > _ENDS:
            raise EOFError("it ends too early")
        return content


def _check_numbers(file: Path, data: meshio.Mesh) -> None:
    """Refuse points that are no finite numbers, where a cell uses them, and cells with points that are not there."""
    points, cells = np.asarray(data.points), [np.asarray(block.data) for block in data.cells if len(block.data)]
    if points.ndim != 2 or points.dtype.kind not in "fiu" or any(nodes.dtype.kind not in "iu" for nodes in cells):
        raise MeshError(str(file), "is damaged: its points or cells are no numbers", "needs a whole file")
    used = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(nodes.ravel() for nodes in cells)]))
    wrong = used[(used < 0) | (used >= len(points))]
    if wrong.size:
        fault = f"is damaged: a cell has point {wrong[0]:.0f} of {len(points)}"
        raise MeshError(str(file), fault, f"needs points from 0 to {len(points) - 1}")
    used_points = points[used.astype(np.int64)]
    if not np.all(np.isfinite(used_points)):
        raise MeshError(str(file), "has coordinates that are no numbers", "needs finite ones")
    farthest = np.abs(used_points).max(initial=0.0)
    if farthest > _FARTHEST:
        raise MeshError(str(file), f"has a coordinate of {farthest:.3g}", f"needs at most {_FARTHEST:g}")


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keep meshio's messages off the console; its errors are reported by ours."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        yield
