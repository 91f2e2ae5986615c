"""Element sizes in a TacTip: fine in the skin that can touch and around the rods, growing into the gel."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.facets import facets_between
from fingerslip.mesh.gmsh_session import MILLIMETRES
from fingerslip.mesh.sizes import GROWTH
from fingerslip.specimens.tactip.numbers import REGIONS, TacTipNumbers

__all__ = [
    "SensorSizes",
    "SmoothCurves",
    "SolidSizes",
    "polygon",
    "size_at_rods",
    "size_function",
    "smooth_curves",
    "with_names",
]


# The same over the thickness of the skin where it cannot touch, in 2D.
_OF_SKIN = 0.6

Floats = NDArray[np.float64]


class SensorSizes(Protocol):
    """Element sizes of a mesh that is finer where it can touch."""

    @property
    def contact_size(self) -> float:
        """Size in the skin that can touch, and at the rods [m]."""
        ...

    @property
    def bulk_size(self) -> float:
        """Largest size [m]."""
        ...

    @property
    def contact_reach(self) -> float:
        """Height above the lowest point up to which the skin is meshed at `contact_size` [m]."""
        ...


class SolidSizes(SensorSizes, Protocol):
    """Element sizes in 3D, where rods have one of their own."""

    @property
    def rod_size(self) -> float:
        """Largest size at rods [m]."""
        ...


def size_at_rods(sensor: TacTipNumbers, share: float = 0.7) -> float:
    """Return the size at the rods of a section [m]: a share of their radius, so that two fit on each half of an end."""
    return share * sensor.rods.radius


def size_function(
    sensor: TacTipNumbers, sizes: SensorSizes, rods: Floats, rod_size: float
) -> Callable[[float, float, float], float]:
    """Return the wanted size [m] at x, y, z [m], looked up on a grid because Gmsh asks for it very often.

    Arrays: rods (n, 2, dim) [m]; rod_size [m].
    """
    spacing = 0.5 * sizes.contact_size
    half = sensor.dome.radius + sensor.dome.flat_radius
    low = np.array([-half, 0.0, 0.0 if rods.shape[2] == 2 or sensor.part == "half" else -half])
    high = np.array([half, sensor.dome.height + sensor.window.thickness, 0.0 if rods.shape[2] == 2 else half])
    axes = [
        start + spacing * np.arange(np.ceil((end - start) / spacing) + 1) for start, end in zip(low, high, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    grid = _sizes(sensor, sizes, points.reshape(-1, 3), rods, rod_size).reshape(points.shape[:3])
    table: Any = grid.tolist()
    x0, y0, z0 = low.tolist()
    nx, ny, nz = (count - 1 for count in map(int, grid.shape))

    def size(x: float, y: float, z: float) -> float:
        i, j, k = (round((value - start) / spacing) for value, start in ((x, x0), (y, y0), (z, z0)))
        size_here: float = table[min(max(i, 0), nx)][min(max(j, 0), ny)][min(max(k, 0), nz)]
        return size_here

    return size


def _sizes(sensor: TacTipNumbers, sizes: SensorSizes, points: Floats, rods: Floats, rod_size: float) -> Floats:
    """Return the wanted sizes [m] at (m, 3) points."""
    beyond = np.maximum(_inside_skin(sensor, points), points[:, 1] - sizes.contact_reach)
    away = np.full(len(points), np.inf)
    for foot, end in rods:
        away = np.minimum(away, _from_axis(points[:, : len(foot)], foot, end) - sensor.rods.radius)
    in_skin = sizes.contact_size + GROWTH * np.maximum(beyond, 0.0)
    at_rods = min(sizes.contact_size, rod_size) + GROWTH * np.maximum(away, 0.0)
    share = _OF_SKIN if sensor.part == "section" else np.inf
    through_skin = share * sensor.skin.thickness + GROWTH * np.maximum(_inside_skin(sensor, points), 0.0)
    wanted: Floats = np.min([np.full_like(away, sizes.bulk_size), in_skin, at_rods, through_skin], axis=0)
    return wanted


def _inside_skin(sensor: TacTipNumbers, points: Floats) -> Floats:
    """Return how far points lie inside the skin [m], about; negative in it."""
    dome = sensor.dome
    across = np.maximum(np.hypot(points[:, 0], points[:, 2]) - dome.flat_radius, 0.0)
    up = dome.radius - np.minimum(points[:, 1], dome.radius)
    deep: Floats = dome.radius - np.hypot(across, up) - sensor.skin.relief - sensor.skin.thickness
    return deep


def _from_axis(points: Floats, foot: Floats, end: Floats) -> Floats:
    """Return the distance of points from the axis of a rod [m]."""
    axis, offset = end - foot, points - foot
    share = np.clip(offset @ axis / (axis @ axis), 0.0, 1.0)
    away: Floats = np.linalg.norm(offset - share[:, None] * axis, axis=1)
    return away


Integers = NDArray[np.int64]


@dataclass(frozen=True)
class SmoothCurves:
    """A line drawn in pieces."""

    points: list[int]  # tags of the points between pieces, and of both ends
    curves: list[int]  # tags of the pieces


def smooth_curves(line: Floats, corners: Integers, first: int | None = None) -> SmoothCurves:
    """Draw a line as cubic splines through its points, one for each piece.

    Arrays: line (n, 2) [m]; corners (k,).
    """
    tags = [_point(point) for point in line[1:]]
    tags = [_point(line[0]) if first is None else first, *tags]
    pieces = [tags[start : end + 1] for start, end in itertools.pairwise(corners)]
    return SmoothCurves([tags[row] for row in corners], [gmsh.model.occ.addSpline(piece) for piece in pieces])


def polygon(corners: Floats) -> int:
    """Draw the surface inside a polygon of (n, 2) corners [m]; return its tag."""
    points = [_point(corner) for corner in corners]
    lines = [gmsh.model.occ.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    surface: int = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop(lines)])
    return surface


def _point(point: Floats) -> int:
    tag: int = gmsh.model.occ.addPoint(*(point * MILLIMETRES), 0.0)
    return tag


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
    bonded = [facets_between(mesh, region, element, _WINDOW) for element in (_SKIN, _GEL)]
    boundaries = {
        "contact": _numbers(outer & ~symmetry & (region[mesh.f2t[0]] == _SKIN)),
        "window_face": np.sort(np.concatenate(bonded)).astype(np.int32),
        "symmetry": _numbers(symmetry),
    }
    groups = [{name: group for name, group in table.items() if len(group)} for table in (regions, boundaries)]
    return dataclasses.replace(mesh, _subdomains=groups[0], _boundaries=groups[1])


def _numbers(chosen: NDArray[np.bool_]) -> NDArray[np.int32]:
    return np.flatnonzero(chosen).astype(np.int32)
