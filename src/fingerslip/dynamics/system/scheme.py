"""Time integration schemes: their numbers, those of HHT-alpha and those of quasi-static steps.

With displacement u, velocity v, acceleration a and the unbalanced force F = C v + K u - f, a step from 0 to 1 finds the
unknown x that solves ::

    M a_1 + w_1 F_1 = w_0 F_0,    u_1 = u~ + c_u x,    v_1 = v~ + c_v x,    a_1 = c_a x

Contact forces are part of F, but for those that a step must not count (:mod:`fingerslip.dynamics.step.release`). The
change of velocity is v_1 - v_0 = h [(1 - m) a_0 + m a_1].
"""

from __future__ import annotations

from dataclasses import dataclass

from fingerslip.arrays import Floats
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive, QuasiStatic, TimeStepping, Timing
from fingerslip.parameters.schema import require_kind


@dataclass(frozen=True)
class Scheme:
    """A time integration scheme with a fixed step, by its numbers; those of a user are the `time` of a model."""

    step: float  # h [s]
    start_weight: float  # w_0, of the unbalanced force at the start of a step [-]
    end_weight: float  # w_1, of the forces at the end of a step, contact forces included [-]
    end_share: float  # m, of the acceleration at the end of a step in the mean over it [-]
    displacement_factor: float  # c_u
    velocity_factor: float  # c_v
    inertia_factor: float  # c_a; 0 where nothing has inertia
    # what u~ and v~ take of displacement, velocity and acceleration at the start
    prediction: tuple[tuple[float, float, float], tuple[float, float, float]]
    # what dissipates: of da.M dv and da.M du, and of du with the unbalanced forces at the start of the step before and
    # at both ends of this one
    losses: tuple[float, float, float, float, float]
    end: float | None = None  # end of the simulation [s], without it that of the programme

    @property
    def factors(self) -> tuple[float, float, float, float, float]:
        """c_u, c_v, c_a, w_0 and w_1, as compiled code takes them."""
        changes = self.displacement_factor, self.velocity_factor, self.inertia_factor
        return (*changes, self.start_weight, self.end_weight)

    def predict(self, displacement: Floats, velocity: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Return u~ [m] and v~ [m/s], the end of a step with no unknown, from (n,) arrays at its start."""
        moved, moving = (a * displacement + b * velocity + c * acceleration for a, b, c in self.prediction)
        return moved, moving

    def dissipation(
        self, displacement: Floats, velocity: Floats, inertia: Floats, unbalances: tuple[Floats, Floats, Floats]
    ) -> float:
        """Return the energy that the scheme takes out in a step [J], from du, dv, M da and unbalanced forces (n,)."""
        of_rates, of_moves, *of_unbalance = self.losses
        lost = of_rates * (inertia @ velocity) + of_moves * (inertia @ displacement)
        unbalance = sum(share * force for share, force in zip(of_unbalance, unbalances, strict=True))
        return float(lost + displacement @ unbalance)


def hht(step: float, alpha: float) -> Scheme:
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
    return Scheme(
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


def static(step: float) -> Scheme:
    """Return quasi-static steps of a length [s]; the unknown is the change of displacement, and nothing has inertia.

    ::

        C v_1 + K u_1 - f_1 = 0,    v_1 = (u_1 - u_0) / h

    They dissipate the work of the unbalanced force at the ends, -du.(F_0 + F_1)/2: a step in equilibrium none; the
    first one may start from an unbalanced state.
    """
    return Scheme(
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


def starts_damped(scheme: Scheme, damping: RayleighDamping, dampers: Floats | None) -> bool:
    """Tell whether damping may end the acceleration at the start within a step that would remember it.

    That is where alpha is below 0 and damping grows with frequency: a step then carries on a share of alpha^2 of an
    acceleration that is by far too large for it. What a step of the scheme leaves of it takes its place.
    """
    return scheme.start_weight < 0.0 and (bool(damping.stiffness) or dampers is not None)


def make_scheme(time: Timing) -> Scheme:
    """Return the scheme of a model's time settings; of steps that control their own error, from record to record."""
    match time:
        case TimeStepping():
            return hht(time.step, time.alpha)
        case QuasiStatic():
            return static(time.step)
        case Adaptive():
            return make_scheme(time.fixed(time.step))
    return require_kind(time, Scheme, "TimeStepping, QuasiStatic, Adaptive or a Scheme", "time")


def has_inertia(model: Model) -> bool:
    """Tell whether a model moves with inertia."""
    return bool(make_scheme(model.time).inertia_factor)
