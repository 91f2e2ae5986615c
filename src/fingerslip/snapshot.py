"""Snapshots of the whole mesh at a time, as VTK has it: points, cells and fields with three components.

Points are reference positions. Programs deform the body by the field ``displacement``; in ParaView the filter *Warp By
Vector* does so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.history import is_solid, nearest_record
from fingerslip.libraries import xr

# Of the size of the body: by how much points of a flat face may lie out of one plane.
_FLAT = 1e-3
# Of its radius: by how much that of a surface of revolution differs.
_ROUND = 1e-6
# Rows and columns of a curved surface from one line of its net to the next.
_LINES = 4


#: Numbers of the kinds of cells in VTK, by the name of the element.
CELL_TYPES: Mapping[str, int] = MappingProxyType({"Q4": 9, "T3": 5, "T6": 22, "H8": 12, "T4": 10, "T10": 24})

_POINT_FIELDS = {"displacement": "snapshot_displacement", "velocity": "snapshot_velocity"}
_CELL_FIELDS = {"strain_energy_density": "snapshot_strain_energy_density", "von_mises": "snapshot_von_mises"}


@dataclass(frozen=True)
class Snapshot:
    """One moment of the whole mesh."""

    time: float  # the moment [s]
    cell_type: int  # the kind of all cells, as VTK numbers them
    points: Floats  # (n_nodes, 3), reference positions [m]
    cells: NDArray[np.integer[Any]]  # (n_cells, n), nodes of each cell, in the order of VTK
    point_fields: Mapping[str, NDArray[Any]]  # (n_nodes, 3), ``displacement`` [m] and ``velocity`` [m/s]
    cell_fields: Mapping[str, NDArray[Any]]  # (n_cells,) [J/m^3]


def read_snapshot(history: xr.Dataset, number: int) -> Snapshot:
    """Return a snapshot of a history."""
    cell_fields = {name: history[stored].values[number] for name, stored in _CELL_FIELDS.items()}
    return Snapshot(
        time=float(history["snapshot_time"].values[number]),
        cell_type=CELL_TYPES[history.attrs["element"]],
        points=in_space(history["node_position"].values),
        cells=history["cell_nodes"].values,
        point_fields={name: in_space(history[stored].values[number]) for name, stored in _POINT_FIELDS.items()},
        cell_fields={**cell_fields, "region": history["cell_region"].values},
    )


def in_space(vectors: Floats) -> Floats:
    """Fill vectors (..., dim) of any unit with zeros up to three components, shape (..., 3)."""
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, 3 - vectors.shape[-1])])


@dataclass(frozen=True)
class Face:
    """A counterface at a moment."""

    number: int  # its number among the counterfaces
    centre: Floats  # (3,), the middle of a flat face's contact, or the point of a curved one that was nearest [m]
    normal: Floats  # (3,), the direction in which it presses
    surface: Floats  # (rows, columns, 3), points on it near the body [m]; two ends of flat ones, in 2D one column
    is_flat: bool

    @property
    def outline(self) -> list[Floats]:
        """Its lines (n, 3) [m] as pictures show them: in 3D the square of a flat face, a net on a curved one."""
        if self.surface.shape[1] == 1:
            return [self.surface[:, 0]]
        rows, columns = (range(0, size, _LINES if size > _LINES else 1) for size in self.surface.shape[:2])
        return [*(self.surface[row] for row in rows), *(self.surface[:, column] for column in columns)]


def faces_at(history: xr.Dataset, number: int, half_side: float) -> tuple[Face, ...]:
    """Return the counterfaces in a snapshot, see :func:`faces_at_record`."""
    return faces_at_record(history, nearest_record(history, float(history["snapshot_time"][number])), half_side)


def faces_at_record(history: xr.Dataset, step: int, half_side: float) -> tuple[Face, ...]:
    """Return the counterfaces in a record, with lines and squares of a half side [m] for flat ones.

    Flat ones are below what may touch them, where the gaps of contact candidates say; others move as recorded. Those of
    old histories, which do not tell their outline, are left out.
    """
    faces = []
    for counterface, normal in enumerate(in_space(history["counterface_normal"].values)):
        centre = _centre_of_flat(history, counterface, step)
        if centre is not None:
            surface = _flat_surface(centre, normal, half_side, is_solid(history))
            faces.append(Face(counterface, centre, normal, surface, is_flat=True))
        elif "counterface_outline" in history.coords:
            surface = _moved_surface(history, counterface, step)
            rows, columns = surface.shape[:2]
            faces.append(Face(counterface, surface[rows // 2, columns // 2], normal, surface, is_flat=False))
    return tuple(faces)


def curved_points(history: xr.Dataset, depth: float) -> Floats:
    """Return the middles of curved counterfaces in all snapshots, and what is a depth [m] below them, (n, dim) [m]."""
    points = [np.empty((0, history.sizes["component"]))]
    if "counterface_outline" not in history.coords:
        return points[0]
    steps = [nearest_record(history, time) for time in history["snapshot_time"].values]
    for number, outline in enumerate(history["counterface_outline"].values):
        if _centre_of_flat(history, number, 0) is None:
            middle = outline[len(outline) // 2, outline.shape[1] // 2]
            moved = middle + history["counterface_displacement"].values[steps, number]
            points += [moved, moved - depth * history["counterface_normal"].values[number]]
    return np.concatenate(points)


def _centre_of_flat(history: xr.Dataset, counterface: int, step: int) -> Floats | None:
    """Return the middle (3,) of a flat counterface's contact candidates, on it [m]; None for any other."""
    # Without snapshots a history does not have the whole mesh.
    points = history["node_position" if "node_position" in history.coords else "contact_position"].values
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    normal, nodes = (
        history["counterface_normal"].values[counterface],
        history["contact_counterface"].values == counterface,
    )
    at = history["contact_position"].values[nodes] + history["contact_displacement"].values[step][nodes]
    on_face = at - history["gap"].values[step][nodes][:, None] * normal
    along = [on_face @ normal]
    if "counterface_outline" in history.coords:
        along.append(history["counterface_outline"].values[counterface] @ normal)
    if not nodes.any() or any(np.ptp(heights) > _FLAT * extent for heights in along):
        return None
    return np.asarray(in_space(on_face.mean(axis=0)[None])[0])


def _flat_surface(centre: Floats, normal: Floats, half_side: float, solid: bool) -> Floats:
    """Return the ends (2, 1, 3) of a line in 2D, the corners (2, 2, 3) of a square in 3D [m]."""
    if not solid:
        along = half_side * np.array([normal[1], -normal[0], 0.0])
        return np.array([[centre - along], [centre + along]])
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along *= half_side / np.linalg.norm(along)
    across = np.cross(normal, along)
    corners = np.array([[-along - across, across - along], [along - across, along + across]])
    return np.asarray(centre + corners)


def _moved_surface(history: xr.Dataset, counterface: int, step: int) -> Floats:
    """Return the points (rows, columns, 3) of a counterface [m], moved and turned as it was recorded."""
    points = in_space(history["counterface_outline"].values[counterface])
    body = str(history["counterface_rigid_body"].values[counterface])
    if body:
        from scipy.spatial.transform import Rotation  # what reads results needs it for these alone

        number = int(np.flatnonzero(history["rigid_body"].values == body)[0])
        centre = in_space(history["rigid_body_centre"].values)[number]
        turn = history["rigid_body_rotation"].values[step, number]
        # In 2D it turns about z.
        rotation = Rotation.from_rotvec(np.pad(turn, (3 - turn.size, 0)))
        arms, axis = points - centre, rotation.as_rotvec()
        radii = np.linalg.norm(arms, axis=-1), np.linalg.norm(np.cross(axis, arms), axis=-1)
        # Where it rolls, a ball or a drum stays as it is, and what was drawn of it is what may touch.
        if all(np.ptp(each) > _ROUND * each.max() for each in radii):
            points = centre + arms @ rotation.as_matrix().T
    return np.asarray(points + in_space(history["counterface_displacement"].values[step, counterface]))
