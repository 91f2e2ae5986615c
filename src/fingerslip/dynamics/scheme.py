"""The HHT-alpha time integration: its coefficients and its closed-form properties.

With u, v, a displacement, velocity and acceleration, step h, and F = C v + K u - f the unbalanced force, a
step from 0 to 1 solves ::

    M a1 + (1 + alpha) F1 - alpha F0 = 0
    u1 = u0 + h v0 + h^2 [(1/2 - beta) a0 + beta a1]
    v1 = v0 + h [(1 - gamma) a0 + gamma a1]

with beta = (1 - alpha)^2 / 4 and gamma = 1/2 - alpha (Hilber, Hughes & Taylor 1977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["HHT", "Predictor", "Scheme", "Static", "hht", "predict"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HHT:
    """Coefficients of the scheme at one step.

    Parameters
    ----------
    step : float
        Time step h [s].
    alpha, beta, gamma : float
        Parameters of the scheme [-].
    """

    step: float
    alpha: float
    beta: float
    gamma: float

    @property
    def inertia_factor(self) -> float:
        """Acceleration per unknown, 1: the unknown is the acceleration."""
        return 1.0

    @property
    def displacement_factor(self) -> float:
        """Change of the displacement per acceleration, beta h^2 [s^2]."""
        return self.beta * self.step**2

    @property
    def velocity_factor(self) -> float:
        """Change of the velocity per acceleration, gamma h [s]."""
        return self.gamma * self.step

    @property
    def spectral_radius_at_infinity(self) -> float:
        """Spectral radius for an infinite step: (1 + alpha)/(1 - alpha), below alpha = -1/3 -alpha/(1 + alpha)."""
        return max((1.0 + self.alpha) / (1.0 - self.alpha), -self.alpha / (1.0 + self.alpha))


@dataclass(frozen=True)
class Static:
    """Quasi-static steps: the unknown is the change of displacement, and nothing has inertia.

    A step from 0 to 1 solves C v1 + K u1 - f1 = 0 with v1 = (u1 - u0) / h.

    Parameters
    ----------
    step : float
        Time step h [s].
    """

    step: float
    alpha: float = 0.0

    @property
    def inertia_factor(self) -> float:
        """Acceleration per unknown, 0: nothing has inertia."""
        return 0.0

    @property
    def displacement_factor(self) -> float:
        """Change of the displacement per unknown, 1."""
        return 1.0

    @property
    def velocity_factor(self) -> float:
        """Change of the velocity per unknown, 1/h [1/s]."""
        return 1.0 / self.step


Scheme = HHT | Static


@dataclass(frozen=True)
class Predictor:
    """Displacement [m] and velocity [m/s] at the end of a step with no acceleration there, each (n,)."""

    displacement: Array
    velocity: Array


def hht(step: float, alpha: float) -> HHT:
    """Return the coefficients for a step [s] and a numerical damping from -1/2 to 0.

    Examples
    --------
    >>> hht(5e-3, 0.0).beta, hht(5e-3, 0.0).gamma
    (0.25, 0.5)
    """
    return HHT(step=step, alpha=alpha, beta=(1.0 - alpha) ** 2 / 4.0, gamma=0.5 - alpha)


def predict(scheme: Scheme, displacement: Array, velocity: Array, acceleration: Array) -> Predictor:
    """Carry a state (three arrays of shape (n,)) over one step as if the unknown then vanished."""
    if isinstance(scheme, Static):
        return Predictor(displacement, np.zeros_like(velocity))
    step = scheme.step
    return Predictor(
        displacement + step * velocity + step**2 * (0.5 - scheme.beta) * acceleration,
        velocity + step * (1.0 - scheme.gamma) * acceleration,
    )
