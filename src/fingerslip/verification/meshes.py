"""Structured meshes of rectangles and boxes for problems with closed forms, and what their kinds of cell differ in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
import skfem
from numpy.typing import ArrayLike

from fingerslip.arrays import Floats
from fingerslip.materials.material import Formulation
from fingerslip.mesh.facets import outward_normals
from fingerslip.model.model import Component

Shift = Callable[[Floats], Floats]
Value = TypeVar("Value")

_KINDS: Mapping[str, tuple[Any, Any]] = {
    "Q4": (skfem.MeshQuad1, None),
    "T3": (skfem.MeshTri1, None),
    "T6": (skfem.MeshTri1, skfem.MeshTri2),
    "H8": (skfem.MeshHex1, None),
    "T4": (skfem.MeshTet1, None),
    "T10": (skfem.MeshTet1, skfem.MeshTet2),
}
#: The sides of a rectangle or box across each axis, the lower one first.
SIDES = {2: (("left", "right"), ("bottom", "top")), 3: (("left", "right"), ("front", "back"), ("bottom", "top"))}


def dimension(element: str) -> int:
    """Return the number of dimensions of a kind of cell."""
    return 2 if element in {"Q4", "T3", "T6"} else 3


def components(element: str, *xyz: Value) -> tuple[Value, ...]:
    """Return values along x, y and z as cells take them: those in 2D have no y but z, their second axis."""
    return xyz if dimension(element) == 3 else (xyz[0], xyz[-1])


def axes_of(element: str) -> tuple[Component, ...]:
    """Return the names of the axes, that of the height last."""
    return ("x", "y", "z") if dimension(element) == 3 else ("x", "y")


def formulation_of(element: str) -> Formulation:
    """Return the formulation, plane strain in 2D."""
    return "solid" if dimension(element) == 3 else "plane_strain"


def box(
    element: str,
    *axes: ArrayLike,
    shift: Shift | None = None,
    regions: Mapping[str, Callable[[Floats], Any]] | None = None,
) -> Any:
    """Return a meshed rectangle or box.

    Coordinates ascend along each axis [m]; of three, cells in 2D take the first and the last. `shift` maps the vertices
    (dim, n) to moved ones after the sides have been named; `regions` are conditions on the cells' centres (dim, n),
    without which all cells are ``bulk``. The sides are left and right across x, bottom and top across the last axis,
    and in 3D front and back across y.
    """
    kind, quadratic = _KINDS[element]
    chosen = components(element, *axes) if len(axes) == 3 else axes
    grid = [np.asarray(axis, dtype=float) for axis in chosen]
    mesh = kind.init_tensor(*grid)
    middles = mesh.p[:, mesh.facets].mean(axis=1)
    boundaries = {}
    for axis, (coordinates, names) in enumerate(zip(grid, SIDES[len(grid)], strict=True)):
        for name, end in zip(names, (coordinates[0], coordinates[-1]), strict=True):
            boundaries[name] = np.flatnonzero(np.abs(middles[axis] - end) < 1e-9 * np.ptp(coordinates))
    centres = mesh.p[:, mesh.t].mean(axis=1)
    conditions = regions or {"bulk": lambda centre: np.full(centre.shape[1], True)}
    subdomains = {name: np.flatnonzero(inside(centres)) for name, inside in conditions.items()}
    moved = mesh if shift is None else kind(np.ascontiguousarray(shift(mesh.p)), mesh.t)
    moved = moved if quadratic is None else quadratic.from_mesh(moved)
    return moved.with_subdomains(subdomains).with_boundaries(boundaries)


def split_boundary(mesh: Any, name: str) -> tuple[Any, tuple[str, ...], Floats]:
    """Name every facet of a boundary by itself, so that each can carry its own traction; normals (n, dim)."""
    facets = np.asarray(mesh.boundaries[name])
    names = tuple(f"{name}-{number}" for number in range(facets.size))
    normals = outward_normals(mesh, facets, mesh.f2t[0, facets])
    boundaries = {part: facets[[number]] for number, part in enumerate(names)}
    return mesh.with_boundaries(boundaries), names, np.ascontiguousarray(normals.T)


def ring(points: Floats) -> Floats:
    """Return points (dim, n) whose first coordinate is the radius [m] and whose second is the angle [rad]."""
    radius, angle = points[0], points[1]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), *points[2:]])


def jiggle(amount: float) -> Shift:
    """Return a shift of the inner vertices, at random by up to `amount` times the mean cell size."""

    def shift(points: Floats) -> Floats:
        low, high = points.min(axis=1, keepdims=True), points.max(axis=1, keepdims=True)
        inner = ((points > low + 1e-9) & (points < high - 1e-9)).all(axis=0)
        size = float(np.prod(high - low) / points.shape[1]) ** (1.0 / len(points))
        noise = np.random.default_rng(1).uniform(-amount * size, amount * size, points.shape)
        return np.asarray(points + noise * inner)

    return shift


def grade(fine: float, size: float, outer: float, ratio: float) -> Floats:
    """Return coordinates (n,) [m] from 0, of one size in the fine zone and growing by `ratio` up to `outer` [m]."""
    inner = np.linspace(0.0, fine, round(fine / size) + 1)
    reach = np.cumsum(size * ratio ** np.arange(1, 200))
    count = int(np.searchsorted(reach, outer - fine)) + 1
    return np.concatenate([inner, fine + reach[:count] * (outer - fine) / reach[count - 1]])


def mirror(coordinates: Floats) -> Floats:
    """Return coordinates (n,) [m] from 0 on, mirrored to both sides, shape (2 n - 1,) [m]."""
    return np.concatenate([-coordinates[:0:-1], coordinates])
