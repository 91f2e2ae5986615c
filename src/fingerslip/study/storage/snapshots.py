"""Snapshots of the whole mesh as files that ParaView opens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["write_snapshots"]


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    The points are reference positions. The field ``displacement`` [m] has three components, so that *Warp By Vector*
    shows the deformed body, to scale or exaggerated.
    """
    from fingerslip.export.paraview import snapshot_mesh, write_series

    times = history["snapshot_time"].values.tolist() if "snapshot_time" in history.coords else []
    if times:
        write_series(folder, "snapshots", ((time, snapshot_mesh(history, number)) for number, time in enumerate(times)))
