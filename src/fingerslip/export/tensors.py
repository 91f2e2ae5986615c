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

    Arrays: returns (n_cells, 3, 3) [Pa].
    """
    return {
        name: full_tensors(history[stored][number].astype(np.float64))
        for name, stored in _STORED.items()
        if stored in history
    }
