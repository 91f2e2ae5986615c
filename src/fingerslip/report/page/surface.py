"""The surfaces of the layers of a solid, and the section where a plane cuts it open, as triangles that move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import nearest_record
from fingerslip.report.scene.scene import region_names

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: State of a vertex that never may touch.
NO_CONTACT = 255
# The ends of the edges on whose middles a quadratic tetrahedron has its fifth to tenth node, in the order of VTK.
_MIDDLES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


@dataclass(frozen=True)
class Surface:
    """Triangles of a solid at several frames."""

    points: Floats  # (n, 3), reference positions of the vertices [m]
    displacements: Floats  # (n_frames, n, 3), [m]
    stress: Floats  # (n_frames, n), von Mises stress, the mean over the cells of the layer around a vertex [Pa]
    states: NDArray[np.uint8]  # (n_frames, n), of the contact, 255 where a vertex may never touch
    triangles: Integers  # (m, 3), vertices of each triangle
    regions: Integers  # (m,), number of its layer
    is_cut: NDArray[np.bool_]  # (m,), whether it lies in the plane that cuts the body open
    cut_at: float  # where that plane stands along z [m]


def surface_arrays(history: xr.Dataset, frames: Sequence[int]) -> Surface:
    """Return the surfaces of all layers, and the section across z through the middle of the body."""
    points, numbers = history["node_position"].values, list(frames)
    # A little beside the middle, where the nodes of symmetric meshes lie.
    cut_at = float(points[:, 2].mean() + 1e-5 * np.ptp(points[:, 2]))
    states = _nodal_states(history, numbers)
    layers = []  # number of a layer, whether it is cut, vertices and triangles
    for number, layer in _layers(history, numbers):
        section = layer.slice(normal="z", origin=(0.0, 0.0, cut_at), generate_triangles=True)
        meshes = ((False, _outside(layer)), (True, section))
        layers += [(number, is_cut, mesh) for is_cut, mesh in meshes if mesh.n_cells]
    starts = np.cumsum([0, *(mesh.n_points for _, _, mesh in layers)])
    count = [mesh.n_cells for _, _, mesh in layers]
    displacements = np.concatenate([mesh.point_data["displacement"] for _, _, mesh in layers])
    return Surface(
        points=np.concatenate([mesh.points for _, _, mesh in layers]),
        displacements=displacements.reshape(-1, len(numbers), 3).swapaxes(0, 1),
        stress=np.concatenate([mesh.point_data["stress"].reshape(-1, len(numbers)) for _, _, mesh in layers]).T,
        states=np.concatenate([_states(mesh, states, is_cut) for _, is_cut, mesh in layers], axis=1),
        triangles=np.concatenate(
            [_triangles(mesh, is_cut) + start for (_, is_cut, mesh), start in zip(layers, starts, strict=False)]
        ),
        regions=np.repeat([number for number, _, _ in layers], count),
        is_cut=np.repeat([is_cut for _, is_cut, _ in layers], count),
        cut_at=cut_at,
    )


def _layers(history: xr.Dataset, frames: list[int]) -> Iterator[tuple[int, Any]]:
    """Yield the number and the mesh of each layer, with displacements and stress at frames for its nodes."""
    # Slow to import, and few pages show solids.
    import pyvista

    is_cube = history.attrs["element"] == "H8"
    cells = history["cell_nodes"].values[:, : 8 if is_cube else 4]
    kind = pyvista.CellType.HEXAHEDRON if is_cube else pyvista.CellType.TETRA
    grid = pyvista.UnstructuredGrid({kind: cells}, history["node_position"].values)
    grid.point_data["displacement"] = np.concatenate(list(history["snapshot_displacement"].values[frames]), axis=1)
    grid.point_data["node"] = np.arange(grid.n_points)
    grid.cell_data["stress"] = history["snapshot_von_mises"].values[frames].T
    for number in range(max(len(region_names(history)), 1)):
        layer = grid.extract_cells(history["cell_region"].values == number)
        if layer.n_cells:
            yield number, layer.cell_data_to_point_data()


def _outside(layer: Any) -> Any:
    """Return the triangles around a layer."""
    import pyvista
    from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter

    surface = vtkGeometryFilter()
    surface.SetInputData(layer)
    surface.Update()
    return pyvista.wrap(surface.GetOutput()).triangulate()


def _triangles(mesh: Any, is_cut: bool) -> Integers:
    """Return the corners of triangles (m, 3); those of a cut all face one way, as the normals of vertices are sums."""
    corners: Integers = mesh.regular_faces.astype(np.int64)
    first, second, third = (mesh.points[corners[:, corner]] for corner in range(3))
    if is_cut:
        backward = np.cross(second - first, third - first)[:, 2] < 0.0
        corners[backward] = corners[backward][:, ::-1]
    return corners


def _states(mesh: Any, states: NDArray[np.uint8], is_cut: bool) -> NDArray[np.uint8]:
    """Return the states of the contact at the vertices of a layer; those of a cut have none."""
    return np.full((len(states), mesh.n_points), NO_CONTACT, np.uint8) if is_cut else states[:, mesh.point_data["node"]]


def _nodal_states(history: xr.Dataset, frames: list[int]) -> NDArray[np.uint8]:
    """Return the states of the contact at all nodes (n_frames, n_nodes)."""
    records = [nearest_record(history, float(time)) for time in history["snapshot_time"].values[frames]]
    states = np.full((len(frames), history.sizes["node"]), NO_CONTACT, dtype=np.uint8)
    states[:, history["contact_node"].values] = history["contact_state"].values[records]
    if history.attrs["element"] == "T10":
        _add_corners(states, history["cell_nodes"].values)
    return states


def _add_corners(of_nodes: NDArray[np.uint8], cells: Integers) -> None:
    """Give corners the state of most candidates around them: quadratic tetrahedra touch with the middles of edges."""
    ends = [cells[:, [end, 4 + middle]] for middle, both in enumerate(_MIDDLES) for end in both]
    corners, middles = np.unique(np.concatenate(ends), axis=0).T
    order = (SLIP, STICK, OPEN)  # the first of equally many
    counts = np.array([[np.bincount(corners, row[middles] == state, len(row)) for row in of_nodes] for state in order])
    beside = (of_nodes == NO_CONTACT) & counts.any(axis=0)
    of_nodes[beside] = np.array(order, dtype=np.uint8)[counts.argmax(axis=0)[beside]]
