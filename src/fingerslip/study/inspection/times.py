"""Times of a run, as users give them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fingerslip.errors import InputError
from fingerslip.units import parse_quantity

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["time_of_run"]


def time_of_run(history: xr.Dataset, text: str, where: str) -> float:
    """Return a time of a run [s]."""
    time, end = parse_quantity(text, "s", where=where), float(history["time"].values[-1])
    if not 0.0 <= time <= end:
        raise InputError(where, f"got {text}", f"needs a time of the run, 0 to {end:.4g} s")
    return time
