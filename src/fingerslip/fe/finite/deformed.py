"""A body at large strain at one displacement: strains and stresses at its quadrature points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.fe.finite.history import History, Left
from fingerslip.materials.finite import log_volume_of

__all__ = ["Deformed"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Deformed:
    """A body at one displacement, at its n_p quadrature points.

    Parameters
    ----------
    deformation : (n_p, dim, dim) array
        Deformation gradients F [-].
    squared : (n_p, dim) array
        Squares of the principal stretches [-].
    directions : (n_p, dim, dim) array
        Principal directions in the reference state, as columns [-].
    log_strain : (n_p, 3) array
        Principal logarithmic strains, the one across the plane last [-].
    stress : (n_p, 3) array
        Principal Kirchhoff stresses with the pressure of mean volumes [Pa].
    mean_volume : (n_groups,) array or None
        Mean ratios of current to reference volume [-]; None where every point stands for itself.
    pressure : (n_p,) array or None
        What mean volumes make the points feel [Pa]; None likewise.
    left : Left or None
        What the start of the step leaves; None in bodies that do not relax.
    pulled : (n_p, k) array or None
        What of it the stress is less at the points, packed and before its mean is taken out [Pa]; None likewise.
    history : History or None
        What the body remembers; None likewise, and before a step has ended.
    """

    deformation: Array
    squared: Array
    directions: Array
    log_strain: Array
    stress: Array
    mean_volume: Array | None
    pressure: Array | None
    left: Left | None = None
    pulled: Array | None = None
    history: History | None = None

    @property
    def log_volume(self) -> Array:
        """Logarithm of the ratio of volumes, of areas in the plane, shape (n_p,) [-]."""
        return log_volume_of(self.log_strain[:, : self.squared.shape[1]])

    @property
    def volume(self) -> Array:
        """Ratio of current to reference volume, of areas in the plane, shape (n_p,) [-]."""
        found: Array = np.sqrt(self.squared[:, 0] * self.squared[:, 1])
        return found if self.squared.shape[1] == 2 else found * np.sqrt(self.squared[:, 2])
