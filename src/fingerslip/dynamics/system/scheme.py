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

__all__ = [
    "LinearScheme",
    "Predictor",
    "Scheme",
    "StepChange",
    "coefficients",
    "hht",
    "make_scheme",
    "start_push",
    "static",
]

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
class LinearScheme:
    """A :class:`Scheme` by its numbers, whose prediction and dissipation are the same for every unknown."""

    step: float  # h [s]
    start_weight: float  # w_0 [-]
    end_weight: float  # w_1 [-]
    end_share: float  # m [-]
    displacement_factor: float  # c_u
    velocity_factor: float  # c_v
    inertia_factor: float  # c_a
    # what displacement and velocity at the end take of displacement, velocity and acceleration at the start
    prediction: tuple[tuple[float, float, float], tuple[float, float, float]]
    # what dissipates: of da.M dv and da.M du, and of du with the unbalanced forces of three times
    losses: tuple[float, float, float, float, float]

    def predict(self, displacement: Array, velocity: Array, acceleration: Array) -> Predictor:
        """Return the end of a step with no unknown, from (n,) arrays [m], [m/s], [m/s^2]."""
        ends = (a * displacement + b * velocity + c * acceleration for a, b, c in self.prediction)
        return Predictor(*ends)

    def dissipation(self, change: StepChange) -> float:
        """Return the energy that the scheme takes out in a step [J]."""
        of_rates, of_moves, *of_unbalance = self.losses
        lost = of_rates * (change.inertia @ change.velocity) + of_moves * (change.inertia @ change.displacement)
        unbalance = sum(share * force for share, force in zip(of_unbalance, change.unbalance, strict=True))
        return float(lost + change.displacement @ unbalance)


def hht(step: float, alpha: float) -> LinearScheme:
    """Return the HHT-alpha scheme for a step [s] and a numerical damping from -1/2 to 0; the unknown is a_1.

    ::

        M a_1 + (1 + alpha) F_1 - alpha F_0 = 0,    beta = (1 - alpha)^2/4,    gamma = 1/2 - alpha
        u_1 = u_0 + h v_0 + h^2 [(1/2 - beta) a_0 + beta a_1]
        v_1 = v_0 + h [(1 - gamma) a_0 + gamma a_1]

    (Hilber, Hughes & Taylor 1977). From the mean of the equations of motion at both ends and the two Newmark relations,
    with changes d and the unbalanced force F at the end of the step and at the start of the step before, it dissipates
    ::

        h (beta - gamma/2) da.M dv - (gamma - 1/2) da.M du + alpha/2 du.(F_end - F_before)

    Examples
    --------
    >>> hht(5e-3, 0.0).velocity_factor, hht(5e-3, 0.0).end_share
    (0.0025, 0.5)
    """
    beta, gamma = (1.0 - alpha) ** 2 / 4.0, 0.5 - alpha
    return LinearScheme(
        step=step,
        start_weight=alpha,
        end_weight=1.0 + alpha,
        end_share=gamma,
        displacement_factor=beta * step**2,
        velocity_factor=gamma * step,
        inertia_factor=1.0,
        prediction=((1.0, step, step**2 * (0.5 - beta)), (0.0, 1.0, step * (1.0 - gamma))),
        losses=(step * (beta - 0.5 * gamma), 0.5 - gamma, -0.5 * alpha, 0.0, 0.5 * alpha),
    )


def static(step: float) -> LinearScheme:
    """Return quasi-static steps of a length [s]; the unknown is the change of displacement, and nothing has inertia.

    ::

        C v_1 + K u_1 - f_1 = 0,    v_1 = (u_1 - u_0) / h

    They dissipate the work of the unbalanced force at the ends, -du.(F_0 + F_1)/2: a step in equilibrium none; the
    first one may start from an unbalanced state.
    """
    return LinearScheme(
        step=step,
        start_weight=0.0,
        end_weight=1.0,
        end_share=1.0,
        displacement_factor=1.0,
        velocity_factor=1.0 / step,
        inertia_factor=0.0,
        prediction=((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        losses=(0.0, 0.0, 0.0, -0.5, -0.5),
    )


def start_push(scheme: Scheme) -> float:
    """Return the share of what damping takes up within a step at the start that pushes the first step of HHT-alpha.

    Starting at rest, the steps together then go as far as this damping lets them: else half a step less.
    """
    alpha = scheme.start_weight
    return 0.5 + alpha + alpha**2 / (4.0 * scheme.end_share * (1.0 + alpha))


def coefficients(scheme: Scheme) -> tuple[tuple[float, float, float, float, float], Array]:
    """Return a scheme as numbers: c_u, c_v, c_a, w_0, w_1, and its prediction as a matrix (2, 3)."""
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
            return static(time.step)
        case Adaptive():
            return make_scheme(time.fixed(time.step))
    return require(time, Scheme, "TimeStepping, QuasiStatic or a scheme", "time")  # type: ignore[type-abstract]
