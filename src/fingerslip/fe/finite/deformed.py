"""A body at large strain at one displacement: strains and stresses at its quadrature points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.fe.finite.history import History, Left
from fingerslip.materials.large_strain import log_volume_of

__all__ = ["Deformed"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Deformed:
    """A body at one displacement, at its n_p quadrature points."""

    deformation: Array  # (n_p, dim, dim), deformation gradients F [-]
    squared: Array  # (n_p, dim), squares of the principal stretches [-]
    directions: Array  # (n_p, dim, dim), principal directions in the reference state, as columns [-]
    log_strain: Array  # (n_p, 3), principal logarithmic strains, the one across the plane last [-]
    stress: Array  # (n_p, 3), principal Kirchhoff stresses with the pressure of mean volumes [Pa]
    mean_volume: Array | None  # (n_groups,), mean ratios of current to reference volume [-]
    pressure: Array | None  # (n_p,), what mean volumes make the points feel [Pa]
    left: Left | None = None  # what the start of the step leaves
    pulled: Array | None = None  # (n_p, k) [Pa]
    history: History | None = None  # what the body remembers

    @property
    def log_volume(self) -> Array:
        """Logarithm of the ratio of volumes, of areas in 2D, shape (n_p,) [-]."""
        return log_volume_of(self.log_strain[:, : self.squared.shape[1]])

    @property
    def volume(self) -> Array:
        """Ratio of current to reference volume, of areas in 2D, shape (n_p,) [-]."""
        result: Array = np.sqrt(self.squared[:, 0] * self.squared[:, 1])
        return result if self.squared.shape[1] == 2 else result * np.sqrt(self.squared[:, 2])
