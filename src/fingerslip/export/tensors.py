"""Stress and strain of all cells of a snapshot as full tensors."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.history import full_tensors

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["cell_tensors"]

_STORED: Mapping[str, str] = MappingProxyType({"stress": "snapshot_stress", "strain": "snapshot_strain"})


def cell_tensors(history: xr.Dataset, number: int) -> dict[str, NDArray[np.float64]]:
    """Return the recorded tensors of all cells in a snapshot.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots; those of old versions hold no tensors.
    number : int
        Number of the snapshot.

    Returns
    -------
    dict of str to (n_cells, 3, 3) array
        Of `stress` (Cauchy's) [Pa] and `strain` (small, or logarithmic at large strain) [-] those that are recorded;
        symmetric, with the shear strains of the tensor, half the engineering ones.
    """
    return {
        name: full_tensors(history[stored][number].astype(np.float64))
        for name, stored in _STORED.items()
        if stored in history
    }
