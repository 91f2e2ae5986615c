"""Snapshots of the whole mesh as files that ParaView opens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.fe.space import build_space

__all__ = ["write_snapshots"]

_CELL_TYPES = {"Q4": "quad", "T3": "triangle", "T6": "triangle6"}
_HEADER = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
_FOOTER = "  </Collection>\n</VTKFile>\n"


def write_snapshots(history: xr.Dataset, mesh: Any, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    mesh : skfem.Mesh
        The mesh that it was computed on.
    folder : Path
        The folder of the run.
    """
    if history.sizes.get("snapshot_time", 0) == 0:
        return
    points, cells = _grid(mesh)
    entries = []
    for place, moment in enumerate(history["snapshot_time"].values):
        name = f"snapshot_{place:04d}.vtu"
        snapshot = meshio.Mesh(points, cells, _point_data(history, place), _cell_data(history, place))
        snapshot.write(folder / name, file_format="vtu")
        entries.append(f'    <DataSet timestep="{float(moment):.9g}" file="{name}"/>\n')
    (folder / "snapshots.pvd").write_text(_HEADER + "".join(entries) + _FOOTER, encoding="utf-8")


def _grid(mesh: Any) -> tuple[NDArray[np.float64], list[tuple[str, NDArray[np.int64]]]]:
    """Return the nodes in three dimensions and the cells as rows of nodes."""
    space = build_space(mesh)
    # Degrees of freedom come node by node, so every dim-th one names a node; the mid-side nodes follow the corners.
    nodes = np.asarray(space.full.element_dofs[:: space.dim] // space.dim, dtype=np.int64).T
    return _in_space(space.positions), [(_CELL_TYPES[space.element], nodes)]


def _point_data(history: xr.Dataset, place: int) -> dict[str, NDArray[np.float64]]:
    names = {"displacement": "snapshot_displacement", "velocity": "snapshot_velocity"}
    return {name: _in_space(history[stored].values[place]) for name, stored in names.items() if stored in history}


def _cell_data(history: xr.Dataset, place: int) -> dict[str, list[NDArray[np.float64]]]:
    names = {"strain_energy_density": "snapshot_strain_energy_density", "von_mises": "snapshot_von_mises"}
    return {name: [history[stored].values[place]] for name, stored in names.items() if stored in history}


def _in_space(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add zeros up to three components, which ParaView wants."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
