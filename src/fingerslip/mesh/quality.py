"""How well shaped the cells of a mesh are, and the limits that a built mesh keeps."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import MeshError
from fingerslip.mesh.facets import are_degenerate
from fingerslip.mesh.mixed import is_degenerate
from fingerslip.units import coordinates

if TYPE_CHECKING:
    import skfem

Integers = NDArray[np.integer]
Nodes = TypeVar("Nodes", bound=NDArray[np.integer])

# Pairs of cells that an error names.
_NAMED = 3
# The corners at the other ends of the edges of each corner: of hexahedra as scikit-fem counts them, and of prisms, with
# the corners of these among those.
_BESIDE = {
    8: np.array([[1, 2, 3], [0, 4, 5], [0, 4, 6], [0, 5, 6], [1, 2, 7], [1, 3, 7], [2, 3, 7], [4, 5, 6]]),
    6: np.array([[1, 2, 3], [2, 0, 4], [0, 1, 5], [5, 4, 0], [3, 5, 1], [4, 3, 2]]),
}
_PRISM = [0, 3, 6, 1, 5, 7]
# Tetrahedra with the first two corners exchanged; the middles of ten nodes are those of 01, 12, 02, 03, 13, 23.
_MIRRORED = {4: [1, 0, 2, 3], 10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]}


@dataclass(frozen=True)
class QualityRow:
    """Quality of the cells of one region."""

    region: str  # name of the region
    cells: int  # number of cells
    scaled_jacobian: float  # least one [-]
    smallest_angle: float  # extreme angles between edges, in 3D between faces [rad]
    largest_angle: float
    aspect_ratio: float  # largest ratio of longest to shortest edge of a cell [-]


class _Quality(NamedTuple):
    """The measures of each cell (n_cells,), those of a region, or their limits."""

    scaled_jacobian: Any  # [-]
    smallest_angle: Any  # [rad]
    largest_angle: Any  # [rad]
    aspect_ratio: Any  # [-]

    def worst(self, cells: NDArray[np.integer]) -> list[float]:
        """Return the worst measure of some cells."""
        extremes = (np.min, np.min, np.max, np.max)
        return [float(worst(values[cells])) for worst, values in zip(extremes, self, strict=True)]


# What every cell of a built mesh keeps.
_QUADRILATERALS = _Quality(0.25, np.radians(15.0), np.radians(165.0), 10.0)
_TETRAHEDRA = _Quality(0.02, np.radians(4.0), np.radians(174.0), 8.0)
_TRIANGLES = _Quality(0.25, np.radians(15.0), np.radians(140.0), 5.0)


def quality_limits(mesh: skfem.Mesh2D) -> _Quality:
    """Return the limits for the cells of a mesh."""
    if mesh.dim() == 3:
        return _TETRAHEDRA
    return _QUADRILATERALS if mesh.t.shape[0] == 4 else _TRIANGLES


def quality_table(mesh: skfem.Mesh2D) -> tuple[QualityRow, ...]:
    """Return the quality of each region of a mesh.

    Parameters
    ----------
    mesh : skfem.Mesh
        Mesh with counter-clockwise quadrilaterals; triangles in any order. Quadratic cells are judged by their
        corners, hexahedra and prisms by the edges and faces that meet at each.

    Examples
    --------
    >>> import skfem
    >>> import fingerslip as fs
    >>> mesh = skfem.MeshQuad().scaled((3e-3, 1e-3)).with_subdomains({"pulp": lambda x: x[0] > -1.0})
    >>> for row in fs.quality_table(mesh):
    ...     print(f"{row.region}: aspect ratio up to {row.aspect_ratio:.1f}")
    pulp: aspect ratio up to 3.0
    """
    quality = _cell_quality(mesh)
    regions = mesh.subdomains or {"mesh": np.arange(mesh.t.shape[1])}
    return tuple(QualityRow(name, len(cells), *quality.worst(cells)) for name, cells in regions.items())


def check_quality(mesh: skfem.Mesh2D) -> None:
    """Refuse a mesh with a cell outside the limits."""
    names = ("scaled Jacobian", "smallest angle in degrees", "largest angle in degrees", "aspect ratio")
    for number, (name, values, limit) in enumerate(zip(names, _cell_quality(mesh), quality_limits(mesh), strict=True)):
        is_least, unit = number < 2, np.degrees(1.0) if "degrees" in name else 1.0
        worst = int(values.argmin() if is_least else values.argmax())
        if (values[worst] <= limit) if is_least else (values[worst] >= limit):
            region = next((region for region, cells in (mesh.subdomains or {}).items() if worst in cells), "mesh")
            where = f"{region} cell {worst} at {coordinates(mesh.p[:, mesh.t[:, worst]].mean(axis=1))}"
            allowed = f"needs {'>' if is_least else '<'} {unit * limit:.3g}"
            raise MeshError(where, f"{name} {unit * values[worst]:.3g}", allowed, "write a smaller bulk_size")


def tetrahedron_margins(corners: Floats) -> Floats:
    """Return how far tetrahedra (m, 4, 3) [m] are inside the limits of built meshes: above 1 inside, 0 where flat."""
    element, limits = _tetrahedra(corners), _TETRAHEDRA
    margins: Floats = np.min(
        [
            element.scaled_jacobian / limits.scaled_jacobian,
            element.smallest_angle / limits.smallest_angle,
            (np.pi - element.largest_angle) / (np.pi - limits.largest_angle),
            limits.aspect_ratio / element.aspect_ratio,
        ],
        axis=0,
    )
    return margins


def _cell_quality(mesh: skfem.Mesh) -> _Quality:
    nodes, is_solid = mesh.t[: mesh.elem.refdom.nnodes], mesh.dim() == 3
    if is_solid and len(nodes) == 4:
        return _tetrahedra(mesh.p[:, nodes].transpose(2, 1, 0))
    # Triangles among quadrilaterals, and prisms among hexahedra.
    few = nodes[2] == nodes[6] if is_solid else is_degenerate(nodes.T)
    measure, fewer = (_polyhedra, nodes[_PRISM]) if is_solid else (_polygons, nodes[:3])
    measures = np.empty((len(_Quality._fields), mesh.nelements))
    for rows, corners in ((~few, nodes), (few, fewer)):
        if rows.any():
            measures[:, rows] = measure(mesh.p[:, corners[:, rows]])
    return _Quality(*measures)


def _polyhedra(corners: Floats) -> _Quality:
    """Measure hexahedra (3, 8, n) or prisms (3, 6, n) [m] at each corner, between the three edges and faces there."""
    points, beside = corners.T, _BESIDE[corners.shape[1]]
    edges = points[:, beside] - points[:, : len(beside), None]
    length = np.linalg.norm(edges, axis=3)
    # Three edges of a prism with equal sides span less than those of a cube.
    jacobian = np.abs(np.linalg.det(edges)) / length.prod(axis=2) * (1.0 if len(beside) == 8 else 2.0 / np.sqrt(3.0))
    # Faces meet at the angles of tetrahedra on the edges of a corner, those along its first three edges.
    at_corners = np.concatenate([np.zeros_like(edges[:, :, :1]), edges], axis=2).reshape(-1, 4, 3)
    angle = _dihedral_angles(at_corners)[:3].reshape(3, len(points), -1)
    length = length.reshape(len(points), -1)
    return _Quality(
        jacobian.min(axis=1), angle.min(axis=(0, 2)), angle.max(axis=(0, 2)), length.max(axis=1) / length.min(axis=1)
    )


def _tetrahedra(corners: Floats) -> _Quality:
    """Measure tetrahedra by their dihedral angles; scikit-fem sorts their corners, so their sign says nothing."""
    edges = np.stack([corners[:, b] - corners[:, a] for a, b in itertools.combinations(range(4), 2)], axis=1)
    length = np.linalg.norm(edges, axis=2)
    volume = np.abs(np.linalg.det(edges[:, :3])) / 6.0
    # The scaled Jacobian of a corner: six volumes over its three edges, 1 / sqrt(2) in a regular tetrahedron.
    at_corner = [[0, 1, 2], [0, 3, 4], [1, 3, 5], [2, 4, 5]]
    jacobian = np.stack([6.0 * volume / np.prod(length[:, edge], axis=1) for edge in at_corner]).min(axis=0)
    angle = _dihedral_angles(corners)
    aspect = length.max(axis=1) / length.min(axis=1)
    return _Quality(np.sqrt(2.0) * jacobian, angle.min(axis=0), angle.max(axis=0), aspect)


def _dihedral_angles(corners: Floats) -> Floats:
    """Return the (6, cells) angles between the faces of tetrahedra of (cells, 4, 3) corners."""
    angles = []
    for first, second in itertools.combinations(range(4), 2):
        other = [corner for corner in range(4) if corner not in (first, second)]
        along = corners[:, second] - corners[:, first]
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        arms = [corners[:, corner] - corners[:, first] for corner in other]
        across = [arm - np.sum(arm * along, axis=1, keepdims=True) * along for arm in arms]
        sine = np.linalg.norm(np.cross(*across), axis=1)
        angles.append(np.arctan2(sine, np.sum(across[0] * across[1], axis=1)))
    return np.stack(angles)


def turns(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Return of polygons (2, k, ...) the edges ahead of and behind each corner, and their cross product (k, ...)."""
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return ahead, back, ahead[0] * back[1] - ahead[1] * back[0]


def _polygons(corners: Floats) -> _Quality:
    """Measure polygons (2, k, n) [m]."""
    ahead, back, cross = turns(corners)
    length = np.linalg.norm(ahead, axis=0)
    # Files count corners either way round; a cell is folded over where it goes against most of the mesh.
    cross *= -1.0 if cross.sum() < 0.0 else 1.0
    angle = np.arctan2(cross, np.sum(ahead * back, axis=0))
    sine = np.sin(angle)
    if corners.shape[1] == 3:
        # scikit-fem sorts the corners of triangles, so their direction says nothing.
        angle, sine = np.abs(angle), np.abs(sine) * 2 / np.sqrt(3.0)
    # A reflex corner has a negative angle here; all the way round it is more than 180 degrees.
    angle = np.where(angle < 0, angle + 2 * np.pi, angle)
    return _Quality(sine.min(axis=0), angle.min(axis=0), angle.max(axis=0), length.max(axis=0) / length.min(axis=0))


def turned_cells(mesh: skfem.Mesh) -> Flags:
    """Return which cells (n_cells,) are mirror images of their reference cell, by the edges of their first corner."""
    reference = mesh.elem.refdom.p
    beside = np.flatnonzero(np.isclose(np.linalg.norm(reference - reference[:, :1], axis=0), 1.0))
    edges = (mesh.p[:, mesh.t[beside]] - mesh.p[:, mesh.t[:1]]).transpose(2, 0, 1)
    sign = np.linalg.det(reference[:, beside] - reference[:, :1])
    return np.asarray(np.linalg.det(edges) * sign < 0.0)


def check_folds(mesh: skfem.Mesh, turned: Flags, where: str = "mesh", labels: Sequence[str] = ()) -> None:
    """Refuse a mesh with two cells on the same side of a facet that they share, and with three cells at a facet.

    Facets of one cell alone, such as those of the outside and of a crack, have nothing to fold over. `turned`
    (n_cells,) tells which cells are mirror images of their reference cell; `labels` are those of cells in a deck.
    """
    sides = 2 * mesh.t2f + _is_in_front(mesh, turned)
    nowhere = are_degenerate(mesh)[mesh.t2f]
    sides[nowhere] = 2 * mesh.nfacets + np.arange(nowhere.sum())
    shared = np.flatnonzero(np.bincount(sides.ravel()) > 1)
    if not shared.size:
        return
    centres = mesh.p[:, mesh.facets[:, shared[:_NAMED] // 2]].mean(axis=1).T
    names = labels or np.arange(mesh.nelements)
    pairs = [np.take(names, np.flatnonzero((sides == side).any(axis=0))[:2]) for side in shared[:_NAMED]]
    named = [f"{pair[0]} and {pair[1]} at {coordinates(at)}" for pair, at in zip(pairs, centres, strict=True)]
    count = f" ({shared.size} pairs in all)" if shared.size > _NAMED else ""
    fault = f"has cells that fold over each other: {', '.join(named)}{count}"
    allowed = f"needs at most one cell on either side of {'an edge' if mesh.dim() == 2 else 'a face'}"
    repair = "move their nodes back, take out a cell that is there twice, or mesh the body again"
    raise MeshError(where, fault, allowed, repair)


def _is_in_front(mesh: skfem.Mesh, turned: Flags) -> Flags:
    """Return on which side of its facets each cell lies, shape (n_cell_facets, n_cells).

    Seen from inside a cell, the corners of a facet run round it in a direction that its reference cell and `turned`
    tell: from the least node towards its lesser neighbour, or not. Cells on either side of a facet see the same corners
    run in opposite directions.
    """
    reference, cells = mesh.elem.refdom, np.arange(mesh.t.shape[1])
    centre = reference.p.mean(axis=1, keepdims=True)
    sides = np.empty(mesh.t2f.shape, dtype=bool)
    for side, corners in zip(sides, reference.facets, strict=True):
        runs_round = np.linalg.det(reference.p[:, corners[: mesh.dim()]] - centre) > 0.0
        nodes = mesh.t[corners]
        least = nodes.argmin(axis=0)
        after, before = nodes[(least + 1) % len(nodes), cells], nodes[least - 1, cells]
        # Of corners that are one node the least is the first, or the last where the others stand between.
        after = np.where(after == nodes[least, cells], nodes[(least + 2) % len(nodes), cells], after)
        before = np.where(before == nodes[least, cells], nodes[least - 2, cells], before)
        runs_up = nodes[0] < nodes[1] if len(nodes) == 2 else after < before
        side[:] = runs_up ^ turned ^ runs_round
    return sides


def positive_tetrahedra(points: Floats, cells: Nodes) -> Nodes:
    """Return tetrahedra (m, 4) or (m, 10) of points (n, 3) whose corners are in the order of positive volume."""
    corners = points[cells[:, :4]]
    mirrored = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    turned = cells.copy()
    turned[mirrored] = turned[mirrored][:, _MIRRORED[cells.shape[1]]]
    return turned
