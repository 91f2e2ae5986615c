"""Snapshots of the whole mesh as files that ParaView opens."""

from __future__ import annotations

from pathlib import Path

import meshio
import xarray as xr

from fingerslip.report.scene.snapshot import Snapshot, read_snapshot

__all__ = ["write_snapshots"]

_HEADER = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
_FOOTER = "  </Collection>\n</VTKFile>\n"


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    The points are reference positions. The field ``displacement`` [m] has three components, so that *Warp By Vector*
    shows the deformed body, to scale or exaggerated.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    folder : Path
        The folder of the run.
    """
    entries = []
    for number in range(history.sizes.get("snapshot_time", 0)):
        name, snapshot = f"snapshot_{number:04d}.vtu", read_snapshot(history, number)
        _mesh(snapshot).write(folder / name, file_format="vtu")
        entries.append(f'    <DataSet timestep="{snapshot.time:.9g}" file="{name}"/>\n')
    if entries:
        (folder / "snapshots.pvd").write_text(_HEADER + "".join(entries) + _FOOTER, encoding="utf-8")


def _mesh(snapshot: Snapshot) -> meshio.Mesh:
    return meshio.Mesh(
        snapshot.points,
        [(snapshot.cell_type.meshio, snapshot.cells)],
        dict(snapshot.point_fields),
        {name: [values] for name, values in snapshot.cell_fields.items()},
    )
