"""Join meshes of several bodies into one."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import skfem
from skfem.generic_utils import OrientedBoundary

from fingerslip.errors import InputError

#: The kinds of meshes with straight edges that those with curved ones are made of.
STRAIGHT = {skfem.MeshTri2: skfem.MeshTri1, skfem.MeshTet2: skfem.MeshTet1, skfem.MeshQuad2: skfem.MeshQuad1}


def join_meshes(meshes: Mapping[str, Any]) -> Any:
    """Return one mesh of several bodies, which stay apart even where they touch.

    Parameters
    ----------
    meshes : mapping of str to skfem.Mesh
        The bodies by name, with cells of one kind.

    Returns
    -------
    skfem.Mesh
        Their nodes and cells, one body behind the other. The region `pulp` of the body `left` is `left_pulp`, and its
        boundary `skin` is `left_skin`.

    Raises
    ------
    InputError
        For no meshes, cells of several kinds, and names that become the same.

    Examples
    --------
    >>> import skfem
    >>> import fingerslip as fs
    >>> square = skfem.MeshQuad().with_subdomains({"pulp": lambda x: x[0] > -1.0})
    >>> joined = fs.join_meshes({"left": square, "right": square.translated((2.0, 0.0))})
    >>> list(joined.subdomains), int(joined.nvertices)
    (['left_pulp', 'right_pulp'], 8)
    """
    if not meshes:
        raise InputError("meshes", "got none", "needs one or more")
    kinds = {name: type(mesh).__name__ for name, mesh in meshes.items()}
    if len(set(kinds.values())) > 1:
        kinds_text = ", ".join(f"{name}: {kind}" for name, kind in kinds.items())
        raise InputError("meshes", f"got {kinds_text}", "needs cells of one kind")
    bodies, kind = list(meshes.values()), type(next(iter(meshes.values())))
    linear = STRAIGHT.get(kind, kind)
    vertices = [mesh.p[:, : mesh.nvertices] for mesh in bodies]
    firsts = itertools.accumulate((mesh.nvertices for mesh in bodies), initial=0)
    cells = np.hstack([mesh.t + first for mesh, first in zip(bodies, firsts, strict=False)])
    joined = linear(np.hstack(vertices), np.ascontiguousarray(cells), sort_t=False, validate=False)
    if linear is not kind:
        joined = kind.from_mesh(joined)
        # Behind the vertices stand the points in the middle of facets or edges, in the order of the bodies, too.
        middles = np.hstack([mesh.doflocs[:, mesh.nvertices :] for mesh in bodies])
        joined = kind(np.ascontiguousarray(np.hstack([*vertices, middles])), joined.t, sort_t=False, validate=False)
    # Facets are numbered by their vertices, and so in the order of the bodies.
    regions, boundaries = _groups(meshes, "subdomains", "nelements"), _groups(meshes, "boundaries", "nfacets")
    return joined.with_subdomains(regions).with_boundaries(boundaries)


def _groups(meshes: Mapping[str, Any], table: str, count: str) -> dict[str, Any]:
    """Return the named groups of all bodies, whose cells or facets are numbered one body behind the other."""
    groups: dict[str, Any] = {}
    first = 0
    for body, mesh in meshes.items():
        for group, members in (getattr(mesh, table) or {}).items():
            name, moved = f"{body}_{group}", np.asarray(members) + first
            if name in groups:
                fault, allowed = f"two {table} become '{name}'", "needs names that stay apart"
                raise InputError("meshes", fault, allowed, "rename a body")
            groups[name] = OrientedBoundary(moved, members.ori) if isinstance(members, OrientedBoundary) else moved
        first += getattr(mesh, count)
    return groups
