"""Up to which frequency a simulation can be trusted: what its time step and its mesh resolve."""

from __future__ import annotations

import warnings

import numpy as np
import skfem
import xarray as xr
from numpy.typing import NDArray

from fingerslip.model import Model

__all__ = ["BandwidthWarning", "mesh_bandwidth", "record_bandwidth", "warn_beyond"]

# At 20 steps a period the trapezoidal rule errs by (2 pi/20)^2 / 12 of the period, 0.8 %.
_STEPS_A_PERIOD = 20.0
# At 10 linear elements a wavelength, waves are too fast or too slow by about (2 pi/10)^2 / 24, 1.6 %.
_ELEMENTS_A_WAVE = 10.0


class BandwidthWarning(UserWarning):
    """A question asks for higher frequencies than the simulation resolves."""


def record_bandwidth(history: xr.Dataset) -> float:
    """Return up to which frequency [Hz] the records of a history resolve a signal: 20 records a period.

    Parameters
    ----------
    history : xarray.Dataset
        A history, or anything else with a coordinate time [s]. The longest of its steps counts.
    """
    times = history["time"].values
    return 1.0 / (_STEPS_A_PERIOD * float(np.diff(times).max())) if times.size > 1 else 0.0


def mesh_bandwidth(model: Model) -> dict[str, float]:
    """Return up to which frequency [Hz] the mesh carries shear waves through each region: 10 edges a wave.

    Parameters
    ----------
    model : Model
        The model. Its time steps are not asked, and rigid regions without a material have no entry.

    Notes
    -----
    Shear waves are the slowest, of speed sqrt(G/rho) with G a third of the material's `stiffness`, as in nearly
    incompressible tissue. The longest edge of a region counts.
    """
    longest = _longest_edges(model.mesh)
    found = {}
    for region, material in model.materials.items():
        cells = model.mesh.subdomains[region]
        speed = np.sqrt(material.stiffness / (3.0 * material.density))
        found[region] = float(speed / (_ELEMENTS_A_WAVE * longest[cells].max()))
    return found


def warn_beyond(history: xr.Dataset, highest: float, what: str) -> None:
    """Warn where a question asks for more than the records resolve.

    Units: highest [Hz].
    """
    known = record_bandwidth(history)
    if highest > known:
        step = 1.0 / (_STEPS_A_PERIOD * highest)
        text = f"{what} reaches {highest:g} Hz, and the records resolve {known:.3g} Hz; a step of {step:.1g} s would do"
        warnings.warn(text, BandwidthWarning, stacklevel=3)


def _longest_edges(mesh: skfem.Mesh) -> NDArray[np.float64]:
    """Return the longest distance between two corners of a cell that share an edge, shape (n_cells,) [m]."""
    corners = mesh.p[:, mesh.t[: mesh.refdom.nnodes]]
    pairs = mesh.refdom.edges if mesh.dim() == 3 else mesh.refdom.facets
    lengths = [np.linalg.norm(corners[:, first] - corners[:, second], axis=0) for first, second in map(tuple, pairs)]
    longest: NDArray[np.float64] = np.max(lengths, axis=0)
    return longest
