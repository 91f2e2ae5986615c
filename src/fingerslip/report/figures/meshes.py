"""Figures of meshes: their regions and boundaries by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import skfem
from matplotlib.artist import Artist
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.arrays import Integers
from fingerslip.fe.space import VTK_HEXAHEDRON
from fingerslip.libraries import pyvista
from fingerslip.report.colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, region_colours
from fingerslip.report.figures import style
from fingerslip.report.scene.scene import vtk_grid
from fingerslip.report.scene.viewer import off_screen, picture_of
from fingerslip.snapshot import CELL_TYPES

_BOUNDARY_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
_HATCHES = ("///", "...", "\\\\\\", "xx", "ooo")
_EDGE, _BODY = "#5c5c5c", "#c9ced3"
_WIDEST, _NARROWEST = 2.6, 1.0  # points
_COLUMNS, _PANEL, _WINDOW = 3, 2.9, (1000, 900)  # inch, pixels
_Vector: TypeAlias = tuple[float, float, float]


# From where a solid is seen, and the sides that are, by the axis that is up: a cut takes the half before it away.
_VIEWS: Mapping[str, tuple[_Vector, tuple[_Vector, ...]]] = {
    "y": ((0.9, 0.55, 1.0), ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
    "z": ((0.9, -1.0, 0.55), ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
}
_CELLS = {"show_edges": True}
#: Surfaces of a mesh, each with how it looks.
_Scene: TypeAlias = list[tuple[Any, Mapping[str, Any]]]


@style.with_style
def mesh_figure(mesh: skfem.Mesh, title: str = "", up: Literal["y", "z"] = "z") -> Figure:
    """Draw the regions and boundaries of a mesh [m]: a section as it is; of a solid half of it, then each boundary."""
    heading = style.join_title("Regions and boundaries", title)
    return _section(mesh, heading) if mesh.dim() == 2 else _solid(mesh, heading, *_VIEWS[up])


def _regions(mesh: skfem.Mesh) -> tuple[dict[str, Integers], dict[str, Integers]]:
    """Return the regions that share no cells with those before them, and those that do."""
    covered = np.zeros(mesh.nelements, dtype=bool)
    alone: dict[str, Integers] = {}
    above: dict[str, Integers] = {}
    for name, cells in (mesh.subdomains or {"no region": np.arange(mesh.nelements)}).items():
        (above if covered[cells].any() else alone)[name] = cells
        covered[cells] = True
    return alone, above


def _section(mesh: skfem.Mesh, heading: str) -> Figure:
    width, height = np.ptp(mesh.p, axis=1)
    size = (6.6, float(np.clip(6.2 * height / width, 1.6, 6.2)))
    figure, (axes,) = style.figure_grid(1, 1, size, heading, ("x [mm]", "y [mm]"))
    points, keys = 1e3 * mesh.p.T, dict[str, Artist]()
    regions, above = _regions(mesh)
    # In a deck a set of elements and one of nodes may share their name.
    shared = {*regions, *above} & set(mesh.boundaries or {})
    colours = region_colours(tuple(regions))
    corners = mesh.t[: mesh.elem.refdom.nnodes].T
    looks: list[dict[str, Any]] = [{"facecolor": colours[name], "linewidth": 0.25} for name in regions]
    looks += [{"facecolor": "none", "linewidth": 0.0, "hatch": hatch} for hatch in _HATCHES * len(above)]
    for (name, cells), look in zip((regions | above).items(), looks, strict=False):
        axes.add_collection(PolyCollection(points[corners[cells]], edgecolor=_EDGE, **look))
        keys[f"{name} (region)" if name in shared else name] = Patch(edgecolor=_EDGE, **look)
    # Wide lines below narrow ones, so that each is seen where several lie on each other.
    boundaries = sorted((mesh.boundaries or {}).items(), key=lambda item: -len(item[1]))
    widths = np.linspace(_WIDEST, _NARROWEST, max(len(boundaries), 2))
    for number, ((name, facets), line) in enumerate(zip(boundaries, widths, strict=False)):
        look = {"color": _BOUNDARY_COLOURS[number % len(_BOUNDARY_COLOURS)], "linewidth": line}
        lines = list(points[mesh.facets[:, np.asarray(facets)].T])
        axes.add_collection(LineCollection(lines, capstyle="round", zorder=3, **look))
        keys[f"{name} (boundary)" if name in shared else name] = Line2D([], [], **look)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.margins(0.03)
    axes.autoscale_view()
    style.add_legend(figure, keys)
    return figure


def _solid(mesh: skfem.Mesh, heading: str, viewer: _Vector, sides: Sequence[_Vector]) -> Figure:
    regions, above = _regions(mesh)
    groups = [(f"region {name}", _surface(mesh, cells)) for name, cells in above.items()]
    groups += [(name, np.asarray(facets)) for name, facets in (mesh.boundaries or {}).items()]
    everything = _surface(mesh, np.arange(mesh.nelements))
    colours, layers = region_colours(tuple(regions)), _opened(mesh, regions, sides)
    scenes: list[_Scene] = [[(layer, {"color": colours[name], **_CELLS}) for name, layer in layers]]
    for _, facets in groups:
        others, chosen = (_polygons(mesh, which) for which in (np.setdiff1d(everything, facets), facets))
        scenes.append([(others, {"color": _BODY, "opacity": 0.3}), (chosen, {"color": BLUE, **_CELLS})])
    names = ["regions, cut open" if len(layers) > len(regions) else "regions", *(name for name, _ in groups)]
    images = _render(mesh, scenes, viewer, sides[-1])
    height = _PANEL * images[0].shape[0] / images[0].shape[1] + 0.3
    figure, panels = style.figure_grid(len(names), _COLUMNS, (_PANEL, height), heading, ("", ""), share="none")
    for axes, name, image in zip(panels, names, images, strict=True):
        style.show_picture(axes, image, name)
    style.add_legend(figure, style.layer_keys(colours, _EDGE))
    return figure


def _surface(mesh: skfem.Mesh, cells: Integers) -> Integers:
    """Return the facets (k,) around cells, which have one of them on one side alone."""
    return np.flatnonzero(np.bincount(mesh.t2f[:, cells].ravel(), minlength=mesh.nfacets) == 1)


def _polygons(mesh: skfem.Mesh, facets: Integers) -> Any:
    """Return facets (k,) as a surface [mm]."""
    return pyvista.PolyData.from_regular_faces(1e3 * mesh.p.T, mesh.facets[:, facets].T)


def _opened(mesh: skfem.Mesh, regions: Mapping[str, Integers], sides: Sequence[_Vector]) -> list[tuple[str, Any]]:
    """Return the surfaces of regions behind a plane through the middle, and where it cuts them; whole if one is lost.

    The plane goes through cells, so that none stands out of it.
    """
    order, kind = (VTK_HEXAHEDRON, "H8") if mesh.elem.refdom.nnodes == 8 else ([0, 1, 2, 3], "T4")
    grid: Any = vtk_grid(mesh.t[order].T, CELL_TYPES[kind], 1e3 * mesh.p.T)
    whole = {name: _polygons(mesh, _surface(mesh, cells)) for name, cells in regions.items()}
    for side in sides:
        plane = {"normal": side, "origin": grid.center}
        behind = {name: surface.clip(**plane) for name, surface in whole.items()}
        if all(surface.n_cells for surface in behind.values()):
            cuts = ((name, grid.extract_cells(cells).slice(**plane)) for name, cells in regions.items())
            return [*behind.items(), *((name, cut) for name, cut in cuts if cut.n_cells)]
    return list(whole.items())


def _render(mesh: skfem.Mesh, scenes: Sequence[_Scene], viewer: _Vector, up: _Vector) -> list[NDArray[np.uint8]]:
    """Return a picture of each scene with the same camera, without what is white in all of them."""
    pictures = []
    with off_screen(_WINDOW) as plotter:
        plotter.add_axes(viewport=(0.0, 0.0, 0.25, 0.25))
        for scene in scenes:
            plotter.clear_actors()
            for surface, look in scene:
                if surface.n_cells:
                    plotter.add_mesh(surface, edge_color=_EDGE, line_width=0.5, ambient=0.6, diffuse=0.45, **look)
            plotter.view_vector(viewer, viewup=up)
            plotter.reset_camera(bounds=np.stack([mesh.p.min(axis=1), mesh.p.max(axis=1)], axis=1).ravel() * 1e3)
            pictures.append(picture_of(plotter))
    return style.crop(pictures)
