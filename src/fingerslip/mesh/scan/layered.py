"""Tetrahedra between the surfaces of skin and phalanx, in layers, by fTetWild."""

from __future__ import annotations

import contextlib
import dataclasses
import tempfile
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from fingerslip.errors import InputError, MeshError, warn_renamed
from fingerslip.mesh.orientation import positive_tetrahedra
from fingerslip.mesh.scan.offset import distances, offset_inwards
from fingerslip.mesh.scan.repair import closed_where
from fingerslip.mesh.scan.surfaces import Surface, check_closed, contains
from fingerslip.mesh.sizes import check_sizes
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.units import coordinates, millimetres

__all__ = ["LayerSizes", "build_from_surfaces"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

_OUTSIDE, _SKIN, _TISSUE, _PHALANX = 0, 1, 2, 3
_GROWTH = 0.4
_PER_BULK_SIZE = 2
_SHALLOWEST_POKE = 1e-6


@parameters
class LayerSizes:
    """Thickness of the skin, element sizes, and what of the finger is meshed.

    Parameters
    ----------
    skin_thickness : float
        Thickness of the skin [m].
    contact_size : float
        Edge length along the skin that can touch [m].
    bulk_size : float
        Largest edge length, far from the contact [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` and called `pad` [m].
    cut : float, optional
        Distance along x from the tip at which the finger is cut off [m]; without it the scan has to be closed.
    phalanx : {'region', 'hole'}
        Whether the phalanx is a region of its own or a hole with the boundary `phalanx_surface`.
    tolerance : float
        How far the mesh may lie off the surfaces [m].
    """

    skin_thickness: PositiveLength = 1e-3
    contact_size: PositiveLength = 0.4e-3
    bulk_size: PositiveLength = 1.6e-3
    contact_reach: PositiveLength = 2e-3
    cut: PositiveLength | None = None
    phalanx: Literal["region", "hole"] = "region"
    tolerance: PositiveLength = 0.05e-3

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)
        if self.tolerance > self.skin_thickness / 4:
            found = f"got {millimetres(self.tolerance)}"
            raise InputError("tolerance", found, f"needs <= {self.skin_thickness * 250:.4g} mm (skin_thickness / 4)")


@dataclass(frozen=True)
class _Bodies:
    """What bounds the layers: closed surfaces, and where the finger is cut."""

    skin: Surface
    tissue: Surface
    phalanx: Surface | None
    cut: float


def build_from_surfaces(
    skin: Surface, phalanx: Surface | None = None, sizes: LayerSizes | None = None, *, bone: Surface | None = None
) -> skfem.MeshTet1:
    """Fill the surfaces of skin and phalanx with tetrahedra.

    The surfaces, one at the depth of the skin and the cut are meshed together, so that cells do not cross them by
    more than the tolerance, and every cell is in the layer that its centre is in. fTetWild (Hu et al. 2020) makes the
    cells; it resolves self-intersections, and no two calls give the same mesh: write the mesh to a file where that
    matters.

    Parameters
    ----------
    skin : Surface
        The skin, placed (tip towards +x, pad down) and repaired; open only proximal of the cut.
    phalanx : Surface, optional
        The phalanx, likewise; none for a finger without.
    sizes : LayerSizes, optional
        Thickness of the skin, element sizes, and what is meshed; without it the defaults.
    bone : Surface, optional
        Old name of `phalanx`.

    Returns
    -------
    skfem.MeshTet1
        Tetrahedra with the regions `skin`, `tissue` and `phalanx` (unless it is a hole) and the boundaries `skin`
        (outside), `pad` (what of it is within the contact reach), `skin_tissue`, `phalanx_surface` and, where the
        finger is cut, `base`.

    Raises
    ------
    MeshError
        Where a surface is open or inside out, the phalanx is not inside the skin, the cut misses the finger, the skin
        leaves no tissue, no facet is left for the pad, or fTetWild fails.
    """
    if bone is not None:
        warn_renamed("bone", "phalanx")
        phalanx = bone
    sizes = sizes or LayerSizes()
    bodies = _bodies(skin, phalanx, sizes)
    points, cells = _tetrahedralised(bodies, sizes)
    layer = _layers(points, cells, bodies)
    return _named(points, cells, layer, bodies, sizes)


def _bodies(skin: Surface, phalanx: Surface | None, sizes: LayerSizes) -> _Bodies:
    """Close the proximal ends, and refuse surfaces that bound no finger."""
    low, high = float(skin.points[:, 0].min()), float(skin.points[:, 0].max())
    cut = low - 1.0 if sizes.cut is None else high - sizes.cut
    if sizes.cut is not None and cut <= low:
        found = f"got {millimetres(sizes.cut)} from the tip"
        allowed = f"needs < {millimetres(high - low)}, the length of the scan along x"
        raise MeshError("cut", found, allowed)
    skin = closed_where(skin, cut)
    check_closed(skin)
    if phalanx is not None:
        phalanx = closed_where(phalanx, cut)
        check_closed(phalanx)
        _check_inside(phalanx, skin, cut)
    return _Bodies(skin, offset_inwards(skin, sizes.skin_thickness), phalanx, cut)


def _check_inside(phalanx: Surface, skin: Surface, cut: float) -> None:
    """Refuse a phalanx that pokes through the skin distal of the cut."""
    points = phalanx.points[phalanx.points[:, 0] > cut]
    if not len(points):
        raise MeshError(phalanx.name, "lies wholly proximal of the cut", "needs to reach past it", "write a larger cut")
    outside = points[~contains(skin, points)]
    depth = distances(skin, outside) if len(outside) else np.zeros(1)
    if depth.max() <= _SHALLOWEST_POKE:
        return
    deepest = outside[int(depth.argmax())]
    share = f"{len(outside)} of {len(points)} points" if len(outside) < len(points) else "all points"
    found = f"pokes {millimetres(depth.max(), 3)} through the skin at {coordinates(deepest, 3)} with {share}"
    repair = "check that both scans have the same unit and axes and the same placement"
    raise MeshError(phalanx.name, found, f"needs to lie inside {skin.name}", repair)


def _tetrahedralised(bodies: _Bodies, sizes: LayerSizes) -> tuple[Floats, Integers]:
    """Mesh the box around all surfaces; cells keep to every surface within the tolerance."""
    import pytetwild

    points, triangles = _soup(bodies, sizes.bulk_size)
    extent = np.ptp(points, axis=0)
    nodes, background, wanted = _size_field(points, bodies, sizes)
    try:
        # fTetWild leaves a file in the working directory.
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            found, cells = pytetwild.tetrahedralize(  # type: ignore[attr-defined]
                points,
                triangles.astype(np.int32),
                edge_length_abs=sizes.bulk_size,
                epsilon=float(sizes.tolerance / np.linalg.norm(extent)),
                # Which cells are inside is decided layer by layer.
                disable_filtering=True,
                bg_vertices=nodes,
                bg_tets=background,
                bg_values=wanted,
                num_threads=1,
            )
    except (RuntimeError, ValueError) as error:
        repair = "decimate the surfaces or write a larger tolerance"
        raise MeshError(
            bodies.skin.name, f"fTetWild says '{error}'", "needs surfaces that it can mesh", repair
        ) from error
    return found, positive_tetrahedra(found, np.asarray(cells, dtype=np.int64))


def _soup(bodies: _Bodies, margin: float) -> tuple[Floats, Integers]:
    """Put all surfaces into one list of triangles, without what lies far behind the cut and with two across it."""
    surfaces = [bodies.skin, bodies.tissue] + ([bodies.phalanx] if bodies.phalanx else [])
    surfaces = [_distal(surface, bodies.cut - margin) for surface in surfaces]
    low, high = bodies.skin.points.min(axis=0), bodies.skin.points.max(axis=0)
    if bodies.cut > low[0]:
        (bottom, back), (top, front) = low[1:], high[1:]
        corners = [[bodies.cut, y, z] for y, z in ((bottom, back), (top, back), (top, front), (bottom, front))]
        surfaces.append(Surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])))
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    triangles = [surface.triangles + start for surface, start in zip(surfaces, first, strict=False)]
    return np.vstack([surface.points for surface in surfaces]), np.vstack(triangles)


def _distal(surface: Surface, lowest: float) -> Surface:
    """Drop the triangles that lie wholly below a value of x."""
    kept = surface.triangles[surface.points[surface.triangles, 0].max(axis=1) > lowest]
    used, numbered = np.unique(kept, return_inverse=True)
    return Surface(surface.points[used], numbered.reshape(-1, 3), surface.name)


def _size_field(points: Floats, bodies: _Bodies, sizes: LayerSizes) -> tuple[Floats, NDArray[np.int32], Floats]:
    """Return a background mesh and the wanted edge length at its nodes.

    It grows with the distance from the skin that can touch.
    """
    import pyvista

    # fTetWild meshes a box that is larger by some of the largest edge lengths.
    low, extent, margin = points.min(axis=0), np.ptp(points, axis=0), 3 * sizes.bulk_size
    count = np.ceil(_PER_BULK_SIZE * (extent + 2 * margin) / sizes.bulk_size).astype(int) + 1
    spacing = (extent + 2 * margin) / (count - 1)
    grid: Any = pyvista.ImageData(dimensions=tuple(count), spacing=tuple(spacing), origin=tuple(low - margin))
    tetrahedra = grid.to_tetrahedra(6)
    nodes = np.asarray(tetrahedra.points, dtype=float)
    cells = np.asarray(tetrahedra.cells, dtype=np.int32).reshape(-1, 5)[:, 1:]
    return nodes, np.ascontiguousarray(cells), _wanted_sizes(nodes, float(spacing.max()), bodies, sizes)


def _wanted_sizes(nodes: Floats, spacing: float, bodies: _Bodies, sizes: LayerSizes) -> Floats:
    """Return the wanted edge length, the contact size at all nodes whose cells may reach the pad."""
    skin = bodies.skin
    kept = skin.triangles[skin.corners[:, :, 0].max(axis=1) > bodies.cut]
    lowest = skin.points[kept, 1].min(axis=1)
    touching = dataclasses.replace(skin, triangles=kept[lowest <= lowest.min() + sizes.contact_reach])
    beyond = np.maximum(distances(touching, nodes) - spacing, 0.0)
    wanted: Floats = np.minimum(sizes.contact_size + _GROWTH * beyond, sizes.bulk_size)
    return wanted


def _layers(points: Floats, cells: Integers, bodies: _Bodies) -> Integers:
    """Return in which layer each cell is."""
    centre = points[cells].mean(axis=1)
    layer = np.full(len(cells), _OUTSIDE)
    kept = np.flatnonzero(centre[:, 0] > bodies.cut)
    kept = kept[contains(bodies.skin, centre[kept])]
    layer[kept] = np.where(contains(bodies.tissue, centre[kept]), _TISSUE, _SKIN)
    if bodies.phalanx is not None:
        layer[kept[contains(bodies.phalanx, centre[kept])]] = _PHALANX
    return _without_crumbs(layer, _Facets.of(cells))


@dataclass(frozen=True)
class _Facets:
    """Facets of cells: their nodes, and the one or two cells at each, -1 for none."""

    nodes: Integers
    cells: Integers

    @classmethod
    def of(cls, cells: Integers) -> _Facets:
        opposite = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]
        every = np.sort(np.concatenate([cells[:, corners] for corners in opposite]), axis=1)
        owner = np.tile(np.arange(len(cells)), 4)
        nodes, place = np.unique(every, axis=0, return_inverse=True)
        pair = np.full((len(nodes), 2), -1)
        order = np.argsort(place.ravel(), kind="stable")
        first = np.searchsorted(place.ravel()[order], np.arange(len(nodes)))
        last = np.append(first[1:], len(order)) - 1
        pair[:, 0] = owner[order[first]]
        pair[last > first, 1] = owner[order[last]][last > first]
        return cls(nodes, pair)


def _without_crumbs(layer: Integers, facets: _Facets) -> Integers:
    """Give pieces of a layer that hang apart from its largest one to the layer that they share most facets with."""
    inner = facets.cells[:, 1] >= 0
    first, second = facets.cells[inner].T
    for _ in range(3):
        same = layer[first] == layer[second]
        piece = _components(len(layer), first[same], second[same])
        size = np.bincount(piece)
        for number in (_OUTSIDE, _SKIN, _TISSUE, _PHALANX):
            members = np.unique(piece[layer == number])
            crumbs = np.isin(piece, members[size[members] < 0.02 * size[members].max(initial=0)])
            layer = _given_away(layer, crumbs, first, second)
    return layer


def _given_away(layer: Integers, crumbs: Booleans, first: Integers, second: Integers) -> Integers:
    """Give each cell of the crumbs to the layer with which it has most facets outside of them."""
    votes = np.zeros((len(layer), 4))
    for own, other in ((first, second), (second, first)):
        counted = crumbs[own] & ~crumbs[other]
        np.add.at(votes, (own[counted], layer[other[counted]]), 1.0)
    chosen = crumbs & votes.any(axis=1)
    return np.where(chosen, votes.argmax(axis=1), layer)


def _components(count: int, first: Integers, second: Integers) -> Integers:
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    found: Integers = connected_components(graph, directed=False)[1]
    return found


def _named(points: Floats, cells: Integers, layer: Integers, bodies: _Bodies, sizes: LayerSizes) -> skfem.MeshTet1:
    """Keep the cells of the body, and name its regions and boundaries."""
    kept = layer != _OUTSIDE
    if sizes.phalanx == "hole":
        kept &= layer != _PHALANX
    kept = _largest_piece(kept, _Facets.of(cells))
    used, numbered = np.unique(cells[kept], return_inverse=True)
    mesh = skfem.MeshTet1(points[used].T.copy(), numbered.reshape(-1, 4).T.copy())
    names = {"skin": _SKIN, "tissue": _TISSUE, "phalanx": _PHALANX}
    regions = {name: np.flatnonzero(layer[kept] == number).astype(np.int32) for name, number in names.items()}
    mesh = mesh.with_subdomains({name: members for name, members in regions.items() if len(members)})
    return mesh.with_boundaries(_boundaries(mesh, layer[kept], bodies, sizes))


def _largest_piece(kept: Booleans, facets: _Facets) -> Booleans:
    """Drop cells that hang on the body by an edge or a point alone."""
    inner = (facets.cells[:, 1] >= 0) & kept[facets.cells].all(axis=1)
    piece = _components(len(kept), *facets.cells[inner].T)
    largest: Booleans = kept & (piece == np.bincount(piece[kept]).argmax())
    return largest


def _boundaries(mesh: skfem.MeshTet1, layer: Integers, bodies: _Bodies, sizes: LayerSizes) -> dict[str, Integers]:
    first, second = mesh.f2t
    outer = second < 0
    low, high = np.sort([layer[first], np.where(outer, _OUTSIDE, layer[second])], axis=0)
    centre = mesh.p[:, mesh.facets].mean(axis=1)
    cut = outer & (np.abs(mesh.p[0, mesh.facets] - bodies.cut).max(axis=0) <= 2 * sizes.tolerance)
    phalanx = (low != _PHALANX) & (high == _PHALANX) & ~outer
    if sizes.phalanx == "hole" and bodies.phalanx is not None:
        free = np.flatnonzero(outer & ~cut)
        near = distances(bodies.phalanx, centre[:, free].T) < distances(bodies.skin, centre[:, free].T)
        phalanx[free[near]] = True
    skin = outer & ~cut & ~phalanx
    bottom = mesh.p[1, mesh.facets[:, skin]].min()
    pad = skin & (mesh.p[1, mesh.facets].max(axis=0) <= bottom + sizes.contact_reach)
    if not pad.any():
        problem = f"no facet of the skin lies within {millimetres(sizes.contact_reach)} of its lowest point"
        raise MeshError("pad", problem, "needs some", "write a larger contact_reach or a smaller contact_size")
    named = {"skin": skin, "pad": pad, "skin_tissue": (low == _SKIN) & (high == _TISSUE), "phalanx_surface": phalanx}
    named["base"] = cut
    return {name: np.flatnonzero(facets).astype(np.int32) for name, facets in named.items() if facets.any()}
