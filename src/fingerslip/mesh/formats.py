"""Files in any format that meshio knows, read and written without its messages."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import meshio

from fingerslip.errors import MeshError
from fingerslip.files import new_files

__all__ = ["read_file", "write_file"]

# What meshio has to be told of some formats.
_OPTIONS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {".msh": MappingProxyType({"file_format": "gmsh22"}), ".stl": MappingProxyType({"binary": True})}
)


def read_file(file: Path, needed: str) -> meshio.Mesh:
    """Read a file.

    Parameters
    ----------
    file : Path
        The file.
    needed : str
        What errors say is needed, such as ``needs a mesh file``.

    Raises
    ------
    MeshError
        Where the file is missing or cannot be read.
    """
    if not file.is_file():
        raise MeshError(str(file), "no such file", needed)
    try:
        with _silence():
            return meshio.read(file)
    # meshio ends the program where no reader fits, and its readers fail in any way on a damaged file.
    except (Exception, SystemExit) as error:
        cause = str(error) if isinstance(error, Exception) else "unknown or damaged format"
        raise MeshError(str(file), f"cannot be read ({cause})", needed) from error


def write_file(file: Path, data: meshio.Mesh, suffixes: str) -> None:
    """Write a file, whole or not at all, in the format that its suffix names.

    ``.msh`` is Gmsh's of version 2.2, ``.stl`` is binary.

    Parameters
    ----------
    file : Path
        The file.
    data : meshio.Mesh
        What is written.
    suffixes : str
        Suffixes that errors name, such as ``.msh, .vtu``.

    Raises
    ------
    MeshError
        Where the suffix is unknown or the folder does not exist.
    ResultError
        Where nothing may be written there, or the disk is full.
    """
    if not file.parent.is_dir():
        raise MeshError(str(file), "the folder does not exist", "needs an existing folder")
    try:
        with _silence(), new_files(file) as partial:
            meshio.write(partial, data, **_OPTIONS.get(file.suffix, {}))
    except (meshio.ReadError, meshio.WriteError, KeyError) as error:
        raise MeshError(str(file), f"cannot be written ({error})", f"needs a suffix such as {suffixes}") from error


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keep meshio's messages off the console; its errors are reported by ours."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        yield
