"""Names of the regions and boundaries of a TacTip's mesh, in the plane and in space."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.facets import facets_between
from fingerslip.specimens.tactip.numbers import REGIONS

__all__ = ["with_names"]

Mesh = TypeVar("Mesh", bound=skfem.Mesh)

_SKIN, _GEL, _RODS, _WINDOW = range(len(REGIONS))
# Facets whose nodes are nearer to the plane of symmetry than this lie on it [m].
_ON_PLANE = 1e-9


def with_names(mesh: Mesh, region: NDArray[np.int64], half: bool) -> Mesh:
    """Return a mesh with the names of its regions and boundaries, without those that are empty.

    Arrays: mesh [m]; region (n_cells,).
    """
    regions = {name: _numbers(region == number) for number, name in enumerate(REGIONS)}
    outer = mesh.f2t[1] < 0
    symmetry = outer & half & (np.abs(mesh.p[-1, mesh.facets]).max(axis=0) < _ON_PLANE)
    bonded = [facets_between(mesh, region, own, _WINDOW) for own in (_SKIN, _GEL)]
    boundaries = {
        "contact": _numbers(outer & ~symmetry & (region[mesh.f2t[0]] == _SKIN)),
        "window_face": np.sort(np.concatenate(bonded)).astype(np.int32),
        "symmetry": _numbers(symmetry),
    }
    groups = [{name: group for name, group in found.items() if len(group)} for found in (regions, boundaries)]
    return dataclasses.replace(mesh, _subdomains=groups[0], _boundaries=groups[1])


def _numbers(chosen: NDArray[np.bool_]) -> NDArray[np.int32]:
    return np.flatnonzero(chosen).astype(np.int32)
