"""Snapshots of the whole mesh as files that ParaView opens."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import xarray as xr
from numpy.typing import NDArray

__all__ = ["write_snapshots"]

_CELL_TYPES = {
    "Q4": "quad",
    "T3": "triangle",
    "T6": "triangle6",
    "H8": "hexahedron",
    "T4": "tetra",
    "T10": "tetra10",
}
_HEADER = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
_FOOTER = "  </Collection>\n</VTKFile>\n"


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    folder : Path
        The folder of the run.
    """
    if history.sizes.get("snapshot_time", 0) == 0:
        return
    points = _in_space(history["node_position"].values)
    cells = [(_CELL_TYPES[history.attrs["element"]], history["cell_nodes"].values)]
    entries = []
    for place, moment in enumerate(history["snapshot_time"].values):
        name = f"snapshot_{place:04d}.vtu"
        snapshot = meshio.Mesh(points, cells, _point_data(history, place), _cell_data(history, place))
        snapshot.write(folder / name, file_format="vtu")
        entries.append(f'    <DataSet timestep="{float(moment):.9g}" file="{name}"/>\n')
    (folder / "snapshots.pvd").write_text(_HEADER + "".join(entries) + _FOOTER, encoding="utf-8")


def _point_data(history: xr.Dataset, place: int) -> dict[str, NDArray[np.float64]]:
    names = {"displacement": "snapshot_displacement", "velocity": "snapshot_velocity"}
    return {name: _in_space(history[stored].values[place]) for name, stored in names.items() if stored in history}


def _cell_data(history: xr.Dataset, place: int) -> dict[str, list[NDArray[np.float64]]]:
    names = {"strain_energy_density": "snapshot_strain_energy_density", "von_mises": "snapshot_von_mises"}
    values = {name: [history[stored].values[place]] for name, stored in names.items() if stored in history}
    return values | {"region": [history["cell_region"].values]}


def _in_space(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add zeros up to three components, which ParaView wants."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
