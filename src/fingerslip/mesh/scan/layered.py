"""Tetrahedra between the surfaces of skin and phalanx, in layers, by fTetWild."""

from __future__ import annotations

import contextlib
import dataclasses
import tempfile
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import InputError, MeshError
from fingerslip.libraries import pyvista
from fingerslip.mesh.facets import connected_pieces, with_groups
from fingerslip.mesh.quality import positive_tetrahedra
from fingerslip.mesh.scan.repair import closed_where
from fingerslip.mesh.scan.surfaces import Surface, check_enclosure, clip_surface, contains, distances, offset_inwards
from fingerslip.mesh.source import check_sizes
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.units import coordinates, millimetres

if TYPE_CHECKING:
    import skfem


# Cells outside the skin and, of those inside it, cells proximal of the cut are no part of the body.
_LAYERS = 5
_OUTSIDE, _PROXIMAL, _SKIN, _TISSUE, _PHALANX = range(_LAYERS)
_CRUMB = 0.02
_GROWTH = 0.4
_PER_BULK_SIZE = 2
_SHALLOWEST_POKE = 1e-6


@parameters
class LayerSizes:
    """Thickness of the skin, element sizes, and what of the finger is meshed.

    See :func:`mesh_scan`.
    """

    skin_thickness: Annotated[PositiveLength, "Thickness of the skin [m]."] = 1e-3
    contact_size: Annotated[PositiveLength, "Edge length along the skin that can touch [m]."] = 0.4e-3
    bulk_size: Annotated[PositiveLength, "Largest edge length, far from the contact [m]."] = 1.6e-3
    contact_reach: Annotated[
        PositiveLength,
        "Height above the lowest point up to which the skin is meshed at `contact_size` and called `pad` [m].",
    ] = 2e-3
    cut: Annotated[
        PositiveLength | None,
        "Distance along x from the tip at which the finger is cut off [m]; without it the scan has to be closed.",
    ] = None
    phalanx: Annotated[
        Literal["region", "hole"],
        "Whether the phalanx is a region of its own or a hole with the boundary `phalanx_surface`.",
    ] = "region"
    tolerance: Annotated[PositiveLength, "How far the mesh may lie off the surfaces [m]."] = 0.05e-3

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)
        if self.tolerance > self.skin_thickness / 4:
            fault = f"got {millimetres(self.tolerance)}"
            raise InputError("tolerance", fault, f"needs <= {self.skin_thickness * 250:.4g} mm (skin_thickness / 4)")


@dataclass(frozen=True)
class _Bodies:
    """What bounds the layers: closed surfaces, and where the finger is cut."""

    skin: Surface
    tissue: Surface
    phalanx: Surface | None
    cut: float


def build_from_surfaces(
    skin: Surface, phalanx: Surface | None = None, sizes: LayerSizes | None = None
) -> skfem.MeshTet1:
    """Fill the surfaces of skin and phalanx with tetrahedra.

    The surfaces, one at the depth of the skin and the cut are meshed together, so that cells do not cross them by
    more than the tolerance, and every cell is in the layer that its centre is in. fTetWild (Hu et al. 2020) makes the
    cells; it resolves self-intersections, and no two calls give the same mesh: write the mesh to a file where that
    matters.

    See :func:`mesh_scan`.

    Parameters
    ----------
    skin : Surface
        The skin, placed (tip towards +x, pad down) and repaired; open only proximal of the cut.
    phalanx : Surface, optional
        The phalanx, likewise; none for a finger without.
    sizes : LayerSizes, optional
        Thickness of the skin, element sizes, and what is meshed; without it the defaults.

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
    sizes = sizes or LayerSizes()
    bodies = _bodies(skin, phalanx, sizes)
    whole = _tetrahedralise(bodies, sizes)
    return _name_groups(whole, _layers(whole, bodies), bodies.cut, sizes)


def _bodies(skin: Surface, phalanx: Surface | None, sizes: LayerSizes) -> _Bodies:
    """Close the proximal ends, and refuse surfaces that bound no finger."""
    low, high = float(skin.points[:, 0].min()), float(skin.points[:, 0].max())
    cut = low - 1.0 if sizes.cut is None else high - sizes.cut
    if sizes.cut is not None and cut <= low:
        fault = f"got {millimetres(sizes.cut)} from the tip"
        allowed = f"needs < {millimetres(high - low)}, the length of the scan along x"
        raise MeshError("cut", fault, allowed)
    skin = closed_where(skin, cut)
    check_enclosure(skin)
    if phalanx is not None:
        phalanx = closed_where(phalanx, cut)
        check_enclosure(phalanx)
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
    fault = f"pokes {millimetres(depth.max(), 3)} through the skin at {coordinates(deepest, 3)} with {share}"
    repair = "check that both scans have the same unit and axes and the same placement"
    raise MeshError(phalanx.name, fault, f"needs to lie inside {skin.name}", repair)


def _tetrahedralise(bodies: _Bodies, sizes: LayerSizes) -> skfem.MeshTet1:
    """Mesh the box around all surfaces; cells keep to every surface within the tolerance."""
    import pytetwild
    import skfem

    points, triangles = _soup(bodies)
    extent = np.ptp(points, axis=0)
    nodes, background, wanted = _size_field(points, bodies, sizes)
    try:
        # fTetWild leaves a file in the working directory.
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            points_meshed, cells = pytetwild.tetrahedralize(  # type: ignore[attr-defined]
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
        fault = f"fTetWild says '{error}'"
        raise MeshError(bodies.skin.name, fault, "needs surfaces that it can mesh", repair) from error
    cells = positive_tetrahedra(points_meshed, np.asarray(cells, dtype=np.int64))
    return skfem.MeshTet1(points_meshed.T.copy(), cells.T.copy())


def _soup(bodies: _Bodies) -> tuple[Floats, Integers]:
    """Put what of the surfaces is distal of the cut into one list of triangles, with two across the cut."""
    surfaces = [bodies.skin, bodies.tissue] + ([bodies.phalanx] if bodies.phalanx else [])
    low, high = bodies.skin.points.min(axis=0), bodies.skin.points.max(axis=0)
    if bodies.cut > low[0]:
        # fTetWild keeps to surfaces that end at the cut better than to surfaces that go through it.
        surfaces = [clip_surface(surface, bodies.cut) for surface in surfaces]
        (bottom, back), (top, front) = low[1:], high[1:]
        corners = [[bodies.cut, y, z] for y, z in ((bottom, back), (top, back), (top, front), (bottom, front))]
        surfaces.append(Surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])))
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    triangles = [surface.triangles + start for surface, start in zip(surfaces, first, strict=False)]
    return np.vstack([surface.points for surface in surfaces]), np.vstack(triangles)


def _size_field(points: Floats, bodies: _Bodies, sizes: LayerSizes) -> tuple[Floats, NDArray[np.int32], Floats]:
    """Return nodes (n, 3) [m] and cells (m, 4) of a background mesh, and the wanted edge lengths (n,) [m] there."""
    # fTetWild meshes a box that is larger by some of the largest edge lengths.
    low, extent, margin = points.min(axis=0), np.ptp(points, axis=0), 3 * sizes.bulk_size
    count = np.ceil(_PER_BULK_SIZE * (extent + 2 * margin) / sizes.bulk_size).astype(int) + 1
    spacing = (extent + 2 * margin) / (count - 1)
    grid: Any = pyvista.ImageData(dimensions=tuple(count), spacing=tuple(spacing), origin=tuple(low - margin))
    tetrahedra = grid.to_tetrahedra(6)
    nodes = np.asarray(tetrahedra.points, dtype=float)
    cells = np.ascontiguousarray(np.asarray(tetrahedra.cells, dtype=np.int32).reshape(-1, 5)[:, 1:])
    return nodes, cells, _wanted_sizes(nodes, float(spacing.max()), bodies, sizes)


def _wanted_sizes(nodes: Floats, spacing: float, bodies: _Bodies, sizes: LayerSizes) -> Floats:
    """Return the contact size at all nodes whose cells may reach the pad, growing with the distance from there."""
    skin = bodies.skin
    triangles = skin.triangles[skin.corners[:, :, 0].max(axis=1) > bodies.cut]
    lowest = skin.points[triangles, 1].min(axis=1)
    touching = dataclasses.replace(skin, triangles=triangles[lowest <= lowest.min() + sizes.contact_reach])
    beyond = np.maximum(distances(touching, nodes) - spacing, 0.0)
    return np.minimum(sizes.contact_size + _GROWTH * beyond, sizes.bulk_size)


def _layers(whole: skfem.MeshTet1, bodies: _Bodies) -> Integers:
    """Return in which layer each cell is, by the position of its centre."""
    centre = whole.p[:, whole.t].mean(axis=1).T
    layer = np.full(len(centre), _OUTSIDE)
    inside = np.flatnonzero(contains(bodies.skin, centre))
    distal = centre[inside, 0] > bodies.cut
    layer[inside[~distal]] = _PROXIMAL
    cells = inside[distal]
    layer[cells] = np.where(contains(bodies.tissue, centre[cells]), _TISSUE, _SKIN)
    if bodies.phalanx is not None:
        layer[cells[contains(bodies.phalanx, centre[cells])]] = _PHALANX
    return _without_crumbs(layer, whole.f2t[:, whole.f2t[1] >= 0])


def _without_crumbs(layer: Integers, neighbours: Integers) -> Integers:
    """Give pieces of a layer that hang apart from its largest one to the layer that they share most facets with.

    The columns of `neighbours` are the pairs of cells that share a facet.
    """
    for _ in range(3):
        same = layer[neighbours[0]] == layer[neighbours[1]]
        piece = connected_pieces(len(layer), neighbours[:, same])
        size = np.bincount(piece)
        for number in range(_LAYERS):
            members = np.unique(piece[layer == number])
            crumbs = np.isin(piece, members[size[members] < _CRUMB * size[members].max(initial=0)])
            votes = np.zeros((len(layer), _LAYERS))
            for first, other in (neighbours, neighbours[::-1]):
                counted = crumbs[first] & ~crumbs[other]
                np.add.at(votes, (first[counted], layer[other[counted]]), 1.0)
            layer = np.where(crumbs & votes.any(axis=1), votes.argmax(axis=1), layer)
    return layer


def _name_groups(whole: skfem.MeshTet1, layer: Integers, cut: float, sizes: LayerSizes) -> skfem.MeshTet1:
    """Keep the cells of the body, and name its regions and boundaries."""
    names = {"skin": _SKIN, "tissue": _TISSUE, "phalanx": _PHALANX}
    if sizes.phalanx == "hole":
        del names["phalanx"]
    body = np.isin(layer, list(names.values()))
    inner = (whole.f2t[1] >= 0) & body[whole.f2t].all(axis=0)
    # Cells that hang on the body by an edge or a point alone are none of it.
    piece = connected_pieces(len(body), whole.f2t[:, inner])
    body &= piece == np.bincount(piece[body]).argmax()
    at_cut = (np.abs(whole.p[0, whole.facets] - cut) <= sizes.tolerance).all(axis=0)
    regions = {name: body & (layer == number) for name, number in names.items()}
    boundaries = _boundaries(whole, layer, body, at_cut & (layer == _PROXIMAL).any())
    # The pad is what of the skin lies wholly within a height above its lowest point.
    skin, height = boundaries["skin"], whole.p[1, whole.facets]
    boundaries["pad"] = skin & (height.max(axis=0) <= height[:, skin].min() + sizes.contact_reach)
    if not boundaries["pad"].any():
        problem = f"no facet of the skin lies within {millimetres(sizes.contact_reach)} of its lowest point"
        raise MeshError("pad", problem, "needs some", "write a larger contact_reach or a smaller contact_size")
    return with_groups(whole, regions, boundaries).restrict(np.flatnonzero(body))


def _boundaries(whole: skfem.MeshTet1, layer: Integers, body: Flags, at_cut: Flags) -> dict[str, Flags]:
    """Return which facets are on the body's boundaries, by the layers of the two cells of each.

    The position of a facet alone would not do: where cells straddle the cut, facets of the base lie far off its plane.
    Beyond the cut there is no skin, so that the cell at a facet of the base may count as outside.
    """
    beyond = whole.f2t < 0
    low, high = np.sort(np.where(beyond, _OUTSIDE, layer[whole.f2t]), axis=0)
    touched = (body[whole.f2t] & ~beyond).any(axis=0)
    return {
        "skin": touched & (low == _OUTSIDE) & ~at_cut,
        "skin_tissue": touched & (low == _SKIN) & (high == _TISSUE),
        "phalanx_surface": touched & (low >= _SKIN) & (low != _PHALANX) & (high == _PHALANX),
        "base": touched & ((low == _PROXIMAL) | ((low == _OUTSIDE) & at_cut)),
    }
