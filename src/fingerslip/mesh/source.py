"""Mesh sources: where the mesh of a model comes from, and how element sizes grow from the contact into the bulk."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    Protocol,
    Self,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.mesh.facets import inner_facets
from fingerslip.mesh.quality import quality_table
from fingerslip.parameters import FileName, PositiveLength, as_mapping, parameters
from fingerslip.storage.files import digest, file_digest
from fingerslip.units import LengthUnit, millimetres

if TYPE_CHECKING:
    import skfem

    from fingerslip.tables.table import Table


@dataclass(frozen=True)
class InspectedMesh:
    """A mesh with what is worth knowing of it."""

    mesh: skfem.Mesh  # the mesh [m]
    tables: tuple[Table, ...]  # first the quality of its cells
    suffix: str = ".msh"  # suffix of the file that it is best written to, where nothing else is said


def inspect_mesh(mesh: skfem.Mesh) -> InspectedMesh:
    """Return a mesh with the quality of its cells, region by region."""
    # What writes tables is slow to load, and most meshes are built only.
    from fingerslip.tables.table import Column, Table

    columns = (
        *map(Column, ("region", "cells")),
        Column("least scaled Jacobian", digits=2),
        *(Column(f"{which} angle", "deg", 0) for which in ("smallest", "largest")),
        Column("largest aspect ratio", digits=1),
    )
    rows = []
    for row in quality_table(mesh):
        angles = math.degrees(row.smallest_angle), math.degrees(row.largest_angle)
        rows.append((row.region, row.cells, row.scaled_jacobian, *angles, row.aspect_ratio))
    return InspectedMesh(mesh, (Table("", columns, tuple(rows), mesh_size_note(mesh)),))


def mesh_size_note(mesh: skfem.Mesh) -> str:
    """Say how many nodes and cells a mesh has, and how its boundaries are called and which lie inside the body."""
    names = []
    for name, facets in (mesh.boundaries or {}).items():
        count = len(inner_facets(mesh, name))
        part = "" if count == len(facets) else f"{count} of {len(facets)} facets "
        names.append(f"{name} ({part}inside the body)" if count else name)
    return f"{mesh.p.shape[1]} nodes, {mesh.t.shape[1]} cells; boundaries: {', '.join(names)}"


class MeshSource(Protocol):
    """Where the mesh of a model comes from: parameters, and what is asked of them.

    A class that derives from this one needs `dim`, `element` and `build`; the rest has answers that suit a source
    without files. The specimen is that of the model: one whose `mesh_sources` name the class, or None where
    `needs_specimen` is false. Errors name a parameter as a study file does, such as ``mesh.contact_size``.
    """

    @property
    def dim(self) -> int | None:
        """Dimension of space; None where only the mesh itself tells."""
        ...

    @property
    def element(self) -> str | None:
        """Kind of cell, such as ``T4``; None where only the mesh itself tells."""
        ...

    @property
    def needs_specimen(self) -> bool:
        """Whether there is no mesh without a specimen."""
        return False

    @property
    def assumes_metres(self) -> bool:
        """Whether lengths are taken as metres without saying so, so that a body that is far too large is refused."""
        return False

    @property
    def element_sizes(self) -> tuple[str, ...]:
        """Names of the parameters that refinement scales."""
        return ()

    def build(self, specimen: Any, /) -> skfem.Mesh:
        """Return the mesh [m], with named regions and boundaries."""
        ...

    def inspect(self, specimen: Any, /) -> InspectedMesh:
        """Return the mesh [m] with tables of what is worth knowing of it, the quality of its cells first."""
        return inspect_mesh(self.build(specimen))

    def key(self, specimen: Any, /) -> str:
        """Return the hash of all that decides the mesh: parameters, shape of the specimen, content of files."""
        return digest([None if specimen is None else specimen.shape, as_mapping(self)])

    def estimated_cells(self, _specimen: Any, /) -> float | None:
        """Return about how many cells the mesh will have, without making it; None where that is unknown."""
        return None

    def contact_spacing(self, _specimen: Any, /) -> float | None:
        """Return the distance between neighbouring nodes that can touch [m], without the mesh; None where unknown."""
        return None

    def refined(self, factor: float, /) -> Self | None:
        """Return the source with its element sizes times a factor; None where it has none to change."""
        if not self.element_sizes:
            return None
        source: Any = self
        scaled = {name: factor * getattr(source, name) for name in self.element_sizes}
        finer: Self = replace(source, **scaled)
        return finer

    def beside(self, _folder: Path, /) -> Self:
        """Return the source with absolute paths, where they are relative to a folder."""
        return self


def choose_source(sources: Sequence[type], values: Mapping[str, Any]) -> type:
    """Choose the class of mesh source that is meant by the keys and values of a file.

    That is the first class with a required parameter among the keys; else the first whose :func:`marks` allow what is
    given, such as `element`; else the first of all without required parameters.
    """
    named = [source for source in sources if not values.keys().isdisjoint(_required_names(source))]
    of_sizes = [source for source in sources if not _required_names(source)]
    names = {name for source in of_sizes for name in marks(source)} & values.keys()
    marked = [
        source for source in of_sizes if names and all(values[name] in marks(source).get(name, ()) for name in names)
    ]
    result = [*named, *marked, *of_sizes]
    if not result:
        needed = " or ".join(", ".join(_required_names(source)) for source in sources)
        raise InputError("mesh", "does not say where the mesh comes from", f"needs {needed}")
    return result[0]


@functools.cache
def marks(source: type) -> Mapping[str, tuple[Any, ...]]:
    """Return the parameters with few named values, by which a class of mesh source is told from others, and these."""
    hints = get_type_hints(source)
    named = {field.name: hints[field.name] for field in fields(source)}
    return {name: get_args(hint) for name, hint in named.items() if get_origin(hint) is Literal}


def _required_names(source: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(source) if field.default is field.default_factory is MISSING)


_HEAVY_DATA = re.compile(r"""=\s*["'](?:HDF|Binary)["'][^>]*>\s*([^<:]+)""")  # names of files in XDMF


def other_files(file: Path) -> list[Path]:
    """Return the files that hold a part of the mesh of a file, as far as they are there."""
    kind = file.suffix.lower()
    if kind == ".inp":
        from fingerslip.mesh.decks.abaqus import included_files

        return included_files(file)
    text = file.read_text(encoding="utf-8", errors="replace") if kind in (".xdmf", ".xmf") else ""
    names = dict.fromkeys(name.strip() for name in _HEAVY_DATA.findall(text))
    return [other for name in names if (other := file.resolve().parent / name).is_file()]


def content_hash(where: str, file: str, allowed: str) -> str:
    """Return the hash of a file and of those that it reads; an error at `where` in a study where one is unreadable."""
    try:
        content, *others = map(file_digest, (Path(file), *other_files(Path(file))))
        return digest([content, *others]) if others else content
    except OSError as error:
        raise InputError(where, f"cannot read {file} ({error.strerror})", allowed) from None


@parameters
class MeshFile(MeshSource):
    """A mesh that is read instead of built.

    Parameters
    ----------
    file : str
        Path of the mesh file, relative to the study file.
    length_unit : {'m', 'cm', 'mm', 'um'}, optional
        Unit of the file's coordinates, where a FEBio file does not say it. Without it they are metres, and a body that
        is absurdly large is refused.
    """

    dim: ClassVar[int | None] = None
    element: ClassVar[str | None] = None

    file: FileName
    length_unit: LengthUnit | None = None

    @property
    def assumes_metres(self) -> bool:
        """Whether the file's coordinates are taken as metres without saying so."""
        from fingerslip.mesh.decks.febio import unit_of_file

        return self.length_unit is None and unit_of_file(Path(self.file)) is None

    def build(self, _specimen: Any = None, /) -> skfem.Mesh:
        """Read the mesh [m]; see :func:`~fingerslip.mesh.io.read_mesh`."""
        from fingerslip.mesh.io import read_mesh

        return read_mesh(self.file, self.length_unit)

    def inspect(self, _specimen: Any = None, /) -> InspectedMesh:
        """Return the mesh [m] with the quality of its cells, what of a deck is left out, and a deck's materials."""
        from fingerslip.mesh.decks.materials import file_materials, study_lines
        from fingerslip.mesh.io import read_mesh_and_rest
        from fingerslip.tables.table import Column, Table

        file = Path(self.file)
        mesh, left_out = read_mesh_and_rest(file, self.length_unit)
        inspected, tables = inspect_mesh(mesh), []
        if file.suffix.lower() == ".feb":
            materials = file_materials(file, self.length_unit)
            left_out += materials.refused
            rows = tuple((f"  {line}",) for line in study_lines(materials.laws))
            note = f"Assumed: {'; '.join(materials.assumed)}." if materials.assumed else ""
            tables = [Table("Materials of the file, as a study has them", (Column("materials:"),), rows, note)]
        if left_out:
            tables.append(Table("Left out of the file", (Column("what"),), tuple((entry,) for entry in left_out)))
        # Regions of decks may share cells, which a .msh does not hold.
        cells = np.concatenate([np.empty(0, dtype=int), *(mesh.subdomains or {}).values()])
        suffix = inspected.suffix if len(np.unique(cells)) == len(cells) else ".vtu"
        return replace(inspected, tables=(*inspected.tables, *tables), suffix=suffix)

    def key(self, _specimen: Any = None, /) -> str:
        """Return the hash of unit and content, also of the files that it reads beside its own."""
        return digest(content_hash("mesh.file", self.file, "needs a mesh file"), self.length_unit)

    def beside(self, folder: Path, /) -> Self:
        """Return the source with an absolute path, where it is relative to a folder."""
        return dataclasses.replace(self, file=str((folder / self.file).resolve()))


GROWTH = 0.2
"""Growth of the element size per length of distance from the finer elements [-]."""


ContactReach = Annotated[
    PositiveLength, "Height above the lowest point up to which the skin is meshed at `contact_size` [m]."
]


class GradedMesh(MeshSource):
    """A source whose mesh of a specimen is finer where it can touch; classes that derive from it have these values."""

    needs_specimen: ClassVar[bool] = True
    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "bulk_size")

    element: str  # kind of cell, such as ``Q4``
    contact_size: float  # size along the skin that can touch [m]
    bulk_size: float  # largest size, far from the contact [m]
    contact_reach: ContactReach

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)


def check_sizes(contact_size: float, bulk_size: float) -> None:
    """Refuse a bulk that is finer than the contact [m]."""
    if bulk_size < contact_size:
        fault = f"got {millimetres(bulk_size)}"
        raise InputError("bulk_size", fault, f"needs >= {millimetres(contact_size)} (contact_size)")


def grade(positions: Floats, sizes: Floats) -> Floats:
    """Divide a length into an even number of parts (m,) of the wanted sizes (n,) [m] at positions (n,) [m]."""
    density = 1.0 / _graded_along(np.diff(positions), sizes)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(positions))])
    count_even = max(2, 2 * round(count[-1] / 2))
    return np.interp(np.linspace(0.0, count[-1], count_even + 1), count, positions)


def size_at(points: Floats, sources: Floats, source_sizes: Floats, bulk_size: float) -> Floats:
    """Return the sizes (n,) [m] wanted at points (n, 2) [m]: those (m,) of sources (m, 2) that grow with distance."""
    distance = np.linalg.norm(points[:, None, :] - sources[None, :, :], axis=2)
    return np.asarray(np.minimum(bulk_size, (source_sizes + GROWTH * distance).min(axis=1)))


def subdivide(curve: Floats, sizes: Floats, turn: float) -> Floats:
    """Divide a finely sampled curve (n, 2) [m] into parts of the wanted sizes (n,) [m], with nodes on its corners.

    Where it bends, parts turn by no more than `turn` [rad].
    """
    step = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    direction = np.diff(curve, axis=0)
    angle = np.abs(np.diff(np.unwrap(np.arctan2(direction[:, 1], direction[:, 0]))))
    corner = angle > turn / 2
    limited = sizes.copy()
    # Points may lie unevenly close on a curve, so the radius comes from the steps on both sides.
    around = (step[1:] + step[:-1]) / 2
    limited[1:-1] = np.minimum(sizes[1:-1], turn * around / np.maximum(np.where(corner, 0.0, angle), 1e-12))
    wanted = _graded_along(step, limited)
    limits = np.concatenate([[0], np.flatnonzero(corner) + 1, [len(curve) - 1]])
    pieces = []
    for a, b in itertools.pairwise(limits):
        density = 1 / wanted[a : b + 1]
        count = np.concatenate([[0.0], np.cumsum(step[a:b] * (density[1:] + density[:-1]) / 2)])
        ends = np.linspace(0.0, count[-1], int(np.ceil(count[-1])) + 1)[:-1]
        pieces.append(np.column_stack([np.interp(ends, count, curve[a : b + 1, k]) for k in (0, 1)]))
    return np.vstack([*pieces, curve[-1:]])


def _graded_along(step: Floats, sizes: Floats) -> Floats:
    """Limit the growth of sizes along a curve, in either direction."""
    along = GROWTH * np.concatenate([[0.0], np.cumsum(step)])
    forward = np.minimum.accumulate(sizes - along) + along
    backward = np.minimum.accumulate((sizes + along)[::-1])[::-1] - along
    return np.minimum(forward, backward)
