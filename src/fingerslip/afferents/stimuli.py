"""What the tissue does at receptors: strain, stress and motion there, and how fast they change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.errors import ResultError
from fingerslip.history import full_tensors, sites_of_kinds
from fingerslip.sites import RECEPTOR_KINDS

Array = NDArray[np.float64]


def receptor_stimuli(history: xr.Dataset, kinds: Sequence[str] = RECEPTOR_KINDS) -> xr.Dataset:
    """Return what the tissue does at the recorded receptors.

    Parameters
    ----------
    history : xarray.Dataset
        A history with receptors.
    kinds : sequence of str, optional
        Receptor types.

    Returns
    -------
    xarray.Dataset
        The variables of :data:`STIMULI`, dimensions (time, site), with `units` and `long_name`, and for each its rate
        ``NAME_rate``: differences over two steps, over one at both ends. Coordinates are time [s], site and site_kind.

    Raises
    ------
    ResultError
        Where no receptor of these types was recorded, or the history is of a version that recorded no strain.
    """
    rows = sites_of_kinds(history, kinds)
    if not rows.size:
        raise ResultError(f"history: has no receptor of the types {', '.join(kinds)}, needs one; record receptors")
    if "strain" not in history:
        raise ResultError("history: holds no strain at the sites, needs it; run the study again with this version")
    at, dims = history.isel(site=rows), ("time", "site")
    times, variables = at["time"].values, {}
    for name, (units, meaning, stimulus) in STIMULI.items():
        values = stimulus(at)
        rate = np.gradient(values, times, axis=0) if times.size > 1 else np.zeros_like(values)
        changing = {"units": f"{units}/s", "long_name": f"rate of {meaning}"}
        variables[name] = xr.Variable(dims, values, {"units": units, "long_name": meaning})
        variables[f"{name}_rate"] = xr.Variable(dims, rate, changing)
    return xr.Dataset(variables, coords={name: at[name] for name in ("time", "site", "site_kind")})


def _equivalent_strain(at: xr.Dataset) -> Array:
    """Return sqrt(2/3 e:e) of the deviator e of the strain tensor."""
    strain = full_tensors(at["strain"])
    mean = np.trace(strain, axis1=-2, axis2=-1) / 3.0
    deviator = strain - mean[..., None, None] * np.eye(3)
    return np.asarray(np.sqrt(2.0 / 3.0 * (deviator**2).sum(axis=(-2, -1))))


def _principal(at: xr.Dataset, which: int) -> Array:
    """Return a principal strain, numbered from the smallest; NaN where the strain across the plane is not known."""
    strain = full_tensors(at["strain"])
    finite = np.asarray(np.isfinite(strain).all(axis=(-2, -1), keepdims=True))
    # Eigenvalues of a tensor with NaN are numbers that mean nothing.
    principal = np.linalg.eigvalsh(np.where(finite, strain, 0.0))
    return np.asarray(np.where(finite[..., 0, 0], principal[..., which], np.nan))


def _length(name: str) -> Callable[[xr.Dataset], Array]:
    return lambda at: np.linalg.norm(at[name].values, axis=-1)


#: Name of each stimulus with its SI unit, its meaning, and how a history gives it.
STIMULI: Mapping[str, tuple[str, str, Callable[[xr.Dataset], Array]]] = MappingProxyType(
    {
        "strain_energy_density": ("J/m^3", "strain energy density", lambda at: at["strain_energy_density"].values),
        "equivalent_strain": ("1", "equivalent strain, sqrt(2/3 e:e) of the deviator", _equivalent_strain),
        "largest_strain": ("1", "largest principal strain", lambda at: _principal(at, 2)),
        "smallest_strain": ("1", "smallest principal strain", lambda at: _principal(at, 0)),
        "pressure": ("Pa", "hydrostatic pressure", lambda at: -at["stress"].values[..., :3].mean(axis=-1)),
        "speed": ("m/s", "speed of the tissue", _length("velocity")),
        "acceleration": ("m/s^2", "acceleration of the tissue", _length("acceleration")),
    }
)
