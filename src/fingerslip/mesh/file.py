"""A mesh file as the source of a mesh."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from fingerslip.digest import digest, file_digest
from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import FileName, parameters
from fingerslip.units import LengthUnit

if TYPE_CHECKING:
    import skfem

__all__ = ["MeshFile"]


@parameters
class MeshFile(MeshSource):
    """A mesh that is read instead of built.

    Parameters
    ----------
    file : str
        Path of the mesh file, relative to the study file.
    length_unit : {'m', 'cm', 'mm', 'um'}, optional
        Unit of the file's coordinates. Without it they are metres, and a body that is absurdly large is refused.
    """

    dim: ClassVar[int | None] = None
    element: ClassVar[str | None] = None

    file: FileName
    length_unit: LengthUnit | None = None

    @property
    def assumes_metres(self) -> bool:
        """Whether the file's coordinates are taken as metres without saying so."""
        return self.length_unit is None

    def build(self, _specimen: Any = None, /) -> skfem.Mesh:
        """Read the mesh [m]; see :func:`~fingerslip.mesh.io.read_mesh`."""
        from fingerslip.mesh.io import read_mesh

        return read_mesh(self.file, self.length_unit or "m")

    def key(self, _specimen: Any = None, /) -> str:
        """Return the hash of the file's content and unit.

        Raises
        ------
        InputError
            Where the file cannot be read.
        """
        try:
            return digest(file_digest(Path(self.file)), self.length_unit)
        except OSError as error:
            found = f"cannot read {self.file} ({error.strerror})"
            raise InputError("mesh.file", found, "needs a mesh file") from None

    def beside(self, folder: Path, /) -> Self:
        """Return the source with an absolute path, where it is relative to a folder."""
        return dataclasses.replace(self, file=str((folder / self.file).resolve()))
