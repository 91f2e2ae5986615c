"""Time integration schemes: one protocol, with HHT-alpha and quasi-static steps behind it.

With displacement u, velocity v, acceleration a and the unbalanced force F = C v + K u - f, a step from 0 to 1 finds the
unknown x that solves ::

    M a_1 + w_1 F_1 = w_0 F_0,    u_1 = u~ + c_u x,    v_1 = v~ + c_v x,    a_1 = c_a x

Contact forces are part of F, but for those that a step must not count (:mod:`fingerslip.dynamics.step.release`). A
scheme is its weights w_0 and w_1, its factors c_u, c_v and c_a, the share m of the end of a step in the change of
velocity v_1 - v_0 = h [(1 - m) a_0 + m a_1], its prediction u~ and v~ from the state at the start, and the energy that
it dissipates by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingerslip.model.timing import Adaptive, QuasiStatic, TimeStepping, Timing
from fingerslip.parameters.schema import require

__all__ = ["HHT", "Predictor", "Scheme", "Static", "StepChange", "coefficients", "hht", "make_scheme", "start_push"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Predictor:
    """The end of a step with no unknown.

    Parameters
    ----------
    displacement : (n,) array
        u~ [m].
    velocity : (n,) array
        v~ [m/s].
    """

    displacement: Array
    velocity: Array


@dataclass(frozen=True)
class StepChange:
    """What a step has changed, for the energy that the scheme dissipates.

    Parameters
    ----------
    displacement : (n,) array
        u_1 - u_0 [m].
    velocity : (n,) array
        v_1 - v_0 [m/s].
    inertia : (n,) array
        M (a_1 - a_0) [N].
    unbalance : tuple of three (n,) arrays
        Unbalanced force at the start of the step before, at the start and at the end of this step [N].
    """

    displacement: Array
    velocity: Array
    inertia: Array
    unbalance: tuple[Array, Array, Array]


class Scheme(Protocol):
    """A time integration scheme with a fixed step."""

    @property
    def step(self) -> float:
        """Time step h [s]."""

    @property
    def start_weight(self) -> float:
        """Weight w_0 of the unbalanced force at the start of a step [-]."""

    @property
    def end_weight(self) -> float:
        """Weight w_1 of the forces at the end of a step, contact forces included [-]."""

    @property
    def end_share(self) -> float:
        """Share m of the acceleration at the end of a step in the mean over it [-]."""

    @property
    def displacement_factor(self) -> float:
        """Change c_u of the displacement per unknown."""

    @property
    def velocity_factor(self) -> float:
        """Change c_v of the velocity per unknown."""

    @property
    def inertia_factor(self) -> float:
        """Acceleration c_a per unknown; 0 where nothing has inertia."""

    def predict(self, displacement: Array, velocity: Array, acceleration: Array) -> Predictor:
        """Return the end of a step with no unknown, from the state at its start: (n,) arrays [m], [m/s], [m/s^2].

        It is linear in the state, and the same for every unknown.
        """

    def dissipation(self, change: StepChange) -> float:
        """Return the energy that the scheme takes out in a step [J], so that the balance of energy closes."""


@dataclass(frozen=True)
class HHT:
    """HHT-alpha; the unknown is the acceleration (Hilber, Hughes & Taylor 1977).

    ::

        M a_1 + (1 + alpha) F_1 - alpha F_0 = 0
        u_1 = u_0 + h v_0 + h^2 [(1/2 - beta) a_0 + beta a_1]
        v_1 = v_0 + h [(1 - gamma) a_0 + gamma a_1]
    """

    step: float  # time step h [s]
    alpha: float  # parameters of the scheme [-]
    beta: float  # parameters of the scheme [-]
    gamma: float  # parameters of the scheme [-]

    @property
    def start_weight(self) -> float:
        """Weight alpha of the unbalanced force at the start [-]."""
        return self.alpha

    @property
    def end_weight(self) -> float:
        """Weight 1 + alpha of the forces at the end [-]."""
        return 1.0 + self.alpha

    @property
    def end_share(self) -> float:
        """Share gamma of the acceleration at the end in the change of velocity [-]."""
        return self.gamma

    @property
    def displacement_factor(self) -> float:
        """Change of the displacement per acceleration, beta h^2 [s^2]."""
        return self.beta * self.step**2

    @property
    def velocity_factor(self) -> float:
        """Change of the velocity per acceleration, gamma h [s]."""
        return self.gamma * self.step

    @property
    def inertia_factor(self) -> float:
        """Acceleration per unknown, 1 [-]."""
        return 1.0

    @property
    def spectral_radius_at_infinity(self) -> float:
        """Spectral radius for an infinite step: (1 + alpha)/(1 - alpha), below alpha = -1/3 -alpha/(1 + alpha)."""
        return max((1.0 + self.alpha) / (1.0 - self.alpha), -self.alpha / (1.0 + self.alpha))

    def predict(self, displacement: Array, velocity: Array, acceleration: Array) -> Predictor:
        """Return the end of a step without acceleration there, from (n,) arrays [m], [m/s], [m/s^2]."""
        return Predictor(
            displacement + self.step * velocity + self.step**2 * (0.5 - self.beta) * acceleration,
            velocity + self.step * (1.0 - self.gamma) * acceleration,
        )

    def dissipation(self, change: StepChange) -> float:
        """Return the energy that the scheme takes out in a step [J].

        From the mean of the equations of motion at both ends and the two Newmark relations, with changes d and the
        unbalanced force F at the end of the step and at the start of the step before::

            h (beta - gamma/2) da.M dv - (gamma - 1/2) da.M du + alpha/2 du.(F_end - F_before)
        """
        earliest, _, end = change.unbalance
        newmark = self.step * (self.beta - 0.5 * self.gamma) * (change.inertia @ change.velocity)
        newmark -= (self.gamma - 0.5) * (change.inertia @ change.displacement)
        return float(newmark + 0.5 * self.alpha * (change.displacement @ (end - earliest)))


@dataclass(frozen=True)
class Static:
    """Quasi-static steps; the unknown is the change of displacement, and nothing has inertia.

    ::

        C v_1 + K u_1 - f_1 = 0,    v_1 = (u_1 - u_0) / h
    """

    step: float  # time step h [s]

    @property
    def start_weight(self) -> float:
        """Weight of the unbalanced force at the start, 0 [-]."""
        return 0.0

    @property
    def end_weight(self) -> float:
        """Weight of the forces at the end, 1 [-]."""
        return 1.0

    @property
    def end_share(self) -> float:
        """Share of the end in a mean over a step, 1 [-]; nothing has inertia."""
        return 1.0

    @property
    def displacement_factor(self) -> float:
        """Change of the displacement per unknown, 1 [-]."""
        return 1.0

    @property
    def velocity_factor(self) -> float:
        """Change of the velocity per unknown, 1/h [1/s]."""
        return 1.0 / self.step

    @property
    def inertia_factor(self) -> float:
        """Acceleration per unknown, 0: nothing has inertia."""
        return 0.0

    def predict(self, displacement: Array, velocity: Array, acceleration: Array) -> Predictor:  # noqa: ARG002
        """Return the displacement (n,) [m] at the start, at rest."""
        return Predictor(displacement, np.zeros_like(velocity))

    def dissipation(self, change: StepChange) -> float:
        """Return the work of the unbalanced force at the ends of a step, -du.(F_0 + F_1)/2 [J].

        A step in equilibrium has none; the first one may start from an unbalanced state.
        """
        _, start, end = change.unbalance
        return -0.5 * float(change.displacement @ (start + end))


def hht(step: float, alpha: float) -> HHT:
    """Return the HHT-alpha scheme for a step [s] and a numerical damping from -1/2 to 0.

    Examples
    --------
    >>> hht(5e-3, 0.0).beta, hht(5e-3, 0.0).gamma
    (0.25, 0.5)
    """
    return HHT(step=step, alpha=alpha, beta=(1.0 - alpha) ** 2 / 4.0, gamma=0.5 - alpha)


def start_push(scheme: Scheme) -> float:
    """Return the share of what damping takes up within a step at the start that pushes the first step of HHT-alpha.

    Starting at rest, the steps together then go as far as this damping lets them: else half a step less.
    """
    alpha = scheme.start_weight
    return 0.5 + alpha + alpha**2 / (4.0 * scheme.end_share * (1.0 + alpha))


def coefficients(scheme: Scheme) -> tuple[tuple[float, float, float, float, float], Array]:
    """Return a scheme as numbers: c_u, c_v, c_a, w_0, w_1, and its prediction as a matrix.

    The prediction (2, 3) takes displacement, velocity and acceleration at the start to displacement and velocity at the
    end: it is the same for every unknown.
    """
    free = scheme.predict(*np.eye(3))
    changes = scheme.displacement_factor, scheme.velocity_factor, scheme.inertia_factor
    return (*changes, scheme.start_weight, scheme.end_weight), np.stack([free.displacement, free.velocity])


def make_scheme(time: Timing) -> Scheme:
    """Return the scheme of a model's time settings.

    Parameters
    ----------
    time : TimeStepping, QuasiStatic, Adaptive or Scheme
        The settings. An object with the members of :class:`Scheme` is the scheme itself. Of steps that control
        their own error it is the scheme of a step from record to record.

    Raises
    ------
    InputError
        For an object that is none of them.
    """
    match time:
        case TimeStepping():
            return hht(time.step, time.alpha)
        case QuasiStatic():
            return Static(time.step)
        case Adaptive():
            return make_scheme(time.fixed(time.step))
    return require(time, Scheme, "TimeStepping, QuasiStatic or a scheme", "time")  # type: ignore[type-abstract]
