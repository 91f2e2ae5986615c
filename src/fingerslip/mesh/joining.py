"""Join meshes of several bodies into one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem.generic_utils import OrientedBoundary

from fingerslip.errors import InputError

Array = NDArray[np.float64]


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
    >>> square = skfem.MeshQuad().with_subdomains({"pulp": lambda x: x[0] > -1.0})
    >>> joined = join_meshes({"left": square, "right": square.translated((2.0, 0.0))})
    >>> list(joined.subdomains), int(joined.nvertices)
    (['left_pulp', 'right_pulp'], 8)
    """
    _check(meshes)
    bodies = list(meshes.values())
    kind, linear = type(bodies[0]), _linear(type(bodies[0]))
    vertices, cells = [mesh.p[:, : mesh.nvertices] for mesh in bodies], [mesh.t for mesh in bodies]
    firsts = _firsts([mesh.nvertices for mesh in bodies])
    joined = linear(
        np.ascontiguousarray(np.hstack(vertices)),
        np.ascontiguousarray(np.hstack([cell + first for cell, first in zip(cells, firsts, strict=True)])),
        sort_t=False,
        validate=False,
    )
    if linear is not kind:
        joined = kind.from_mesh(joined)
        # Behind the vertices stand the points in the middle of facets or edges, in the order of the bodies, too.
        middles = np.hstack([mesh.doflocs[:, mesh.nvertices :] for mesh in bodies])
        joined = kind(np.ascontiguousarray(np.hstack([*vertices, middles])), joined.t, sort_t=False, validate=False)
    return joined.with_subdomains(_regions(meshes)).with_boundaries(_boundaries(meshes))


def _linear(kind: Any) -> Any:
    """Return the kind of mesh with straight edges that a kind with curved ones is made of."""
    import skfem

    return {skfem.MeshTri2: skfem.MeshTri1, skfem.MeshTet2: skfem.MeshTet1, skfem.MeshQuad2: skfem.MeshQuad1}.get(
        kind, kind
    )


def _check(meshes: Mapping[str, Any]) -> None:
    if not meshes:
        raise InputError("meshes", "got none", "needs one or more")
    kinds = {name: type(mesh).__name__ for name, mesh in meshes.items()}
    if len(set(kinds.values())) > 1:
        kinds_text = ", ".join(f"{name}: {kind}" for name, kind in kinds.items())
        raise InputError("meshes", f"got {kinds_text}", "needs cells of one kind")
    for table in ("subdomains", "boundaries"):
        names = [f"{name}_{name_of_set}" for name, mesh in meshes.items() for name_of_set in getattr(mesh, table) or {}]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise InputError("meshes", f"two {table} become '{twice}'", "needs names that stay apart", "rename a body")


def _firsts(counts: list[int]) -> NDArray[np.int64]:
    """Return where each part begins, when parts of some sizes stand one behind the other."""
    return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)


def _regions(meshes: Mapping[str, Any]) -> dict[str, Any]:
    firsts = _firsts([mesh.nelements for mesh in meshes.values()])
    return {
        f"{name}_{name_of_set}": np.asarray(subdomain) + first
        for (name, mesh), first in zip(meshes.items(), firsts, strict=True)
        for name_of_set, subdomain in (mesh.subdomains or {}).items()
    }


def _boundaries(meshes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the boundaries; facets are numbered by their vertices, and so in the order of the bodies."""
    firsts = _firsts([mesh.nfacets for mesh in meshes.values()])
    return {
        f"{name}_{name_of_set}": _shift(boundary, int(first))
        for (name, mesh), first in zip(meshes.items(), firsts, strict=True)
        for name_of_set, boundary in (mesh.boundaries or {}).items()
    }


def _shift(facets: Any, first: int) -> Any:
    moved = np.asarray(facets) + first
    return OrientedBoundary(moved, facets.ori) if isinstance(facets, OrientedBoundary) else moved
