"""Snapshots of the whole mesh at a time, as VTK has it: points, cells and fields with three components.

Points are reference positions. Programs deform the body by the field ``displacement``; in ParaView the filter *Warp By
Vector* does so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.history import nearest_record

if TYPE_CHECKING:
    import xarray as xr


Floats = NDArray[np.float64]

# Of the size of the body: by how much points of a flat face may lie out of one plane.
_FLAT = 1e-3


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
    """Fill vectors (n, dim) of any unit with zeros up to three components, shape (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


@dataclass(frozen=True)
class FlatFace:
    """A flat counterface at a moment."""

    number: int  # its number among the counterfaces
    centre: Floats  # (3,), the middle of what may touch it, on the face [m]
    normal: Floats  # (3,), its outward unit normal


def flat_faces(history: xr.Dataset, number: int) -> tuple[FlatFace, ...]:
    """Return the flat counterfaces where the gaps of the contact candidates say that they are."""
    step = nearest_record(history, float(history["snapshot_time"][number]))
    extent = float(np.linalg.norm(np.ptp(history["node_position"].values, axis=0)))
    faces = []
    for counterface, normal in enumerate(history["counterface_normal"].values):
        nodes = history["contact_counterface"].values == counterface
        at = history["contact_position"].values[nodes] + history["contact_displacement"].values[step][nodes]
        on_face = at - history["gap"].values[step][nodes][:, None] * normal
        # The faces that are left out are curved.
        if nodes.any() and np.ptp(on_face @ normal) <= _FLAT * extent:
            faces.append(FlatFace(counterface, in_space(on_face.mean(axis=0)[None])[0], in_space(normal[None])[0]))
    return tuple(faces)
