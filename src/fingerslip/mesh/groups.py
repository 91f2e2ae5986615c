"""Named groups of a mesh, and the messages for names that it does not have."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.errors import MeshError

__all__ = ["require_boundary", "require_region"]

Integers = NDArray[np.int32]


def require_boundary(mesh: skfem.Mesh, name: str, where: str) -> Integers:
    """Return the facets of a named boundary.

    Raises
    ------
    MeshError
        Where the mesh has no boundary of that name.
    """
    return _require(mesh.boundaries or {}, name, where, "boundary")


def require_region(mesh: skfem.Mesh, name: str, where: str) -> Integers:
    """Return the cells of a named region.

    Raises
    ------
    MeshError
        Where the mesh has no region of that name.
    """
    return _require(mesh.subdomains or {}, name, where, "region")


def _require(groups: Mapping[str, Integers], name: str, where: str, kind: str) -> Integers:
    if name in groups:
        return np.asarray(groups[name])
    near = difflib.get_close_matches(name, groups, n=1)
    mend = f"did you mean '{near[0]}'?" if near else ""
    raise MeshError(where, f"{kind} '{name}' is not in the mesh", f"it has: {', '.join(groups) or 'none'}", mend)
