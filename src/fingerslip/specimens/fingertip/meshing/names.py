"""Names of the regions and boundaries of a fingertip's mesh, in 2D and in 3D."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.facets import facets_between, outward_normals
from fingerslip.specimens.fingertip.numbers import REGIONS

__all__ = ["DERMIS", "EPIDERMIS", "NAIL", "PHALANX", "TISSUE", "with_names"]

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Mesh = TypeVar("Mesh", bound=skfem.Mesh)

_NAMES = (*REGIONS, "nail")
EPIDERMIS, DERMIS, TISSUE, PHALANX, NAIL = range(len(_NAMES))

_INTERFACES = {
    "epidermis_dermis": (EPIDERMIS, DERMIS),
    "dermis_tissue": (DERMIS, TISSUE),
    "phalanx_surface": (TISSUE, PHALANX),
}
# Facets of the phalanx that face down and up within 60 degrees.
_STEEPEST = 0.5


def with_names(mesh: Mesh, region: Integers, fine: Flags) -> Mesh:
    """Return a mesh with the names of its regions and boundaries, without those that are empty.

    Arrays: region (n_cells,); fine (n_skin_nodes,).
    """
    regions = {name: _numbers(region == number) for number, name in enumerate(_NAMES)}
    boundaries = {name: facets_between(mesh, region, *pair) for name, pair in _INTERFACES.items()}
    boundaries |= _outside(mesh, region, fine)
    boundaries |= _faces_of_phalanx(mesh, region, boundaries["phalanx_surface"])
    groups = [{name: group for name, group in table.items() if len(group)} for table in (regions, boundaries)]
    return dataclasses.replace(mesh, _subdomains=groups[0], _boundaries=groups[1])


def _outside(mesh: skfem.Mesh, region: Integers, fine: Flags) -> dict[str, NDArray[np.int32]]:
    """Return the facets on the outside: skin, its finely meshed part, the nail, and the proximal cut."""
    outer = mesh.f2t[1] < 0
    on_skin = (mesh.facets < len(fine)).all(axis=0) & outer
    cut, cell = outer & ~on_skin, region[mesh.f2t[0]]
    return {
        "skin": _numbers(on_skin),
        "pad": _numbers(on_skin & np.isin(mesh.facets, np.flatnonzero(fine)).all(axis=0)),
        "nail": _numbers(on_skin & (cell == NAIL)),
        "base": _numbers(cut),
        "phalanx_base": _numbers(cut & (cell == PHALANX)),
    }


def _faces_of_phalanx(mesh: skfem.Mesh, region: Integers, surface: NDArray[np.int32]) -> dict[str, NDArray[np.int32]]:
    first, second = mesh.f2t[:, surface]
    upward = outward_normals(mesh, surface, np.where(region[first] == PHALANX, first, second))[1]
    return {"phalanx_palmar": surface[upward < -_STEEPEST], "phalanx_dorsal": surface[upward > _STEEPEST]}


def _numbers(chosen: Flags) -> NDArray[np.int32]:
    return np.flatnonzero(chosen).astype(np.int32)
