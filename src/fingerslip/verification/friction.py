"""Friction laws against the closed form of a uniform contact, and their derivatives by finite differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fingerslip.contact.friction import Anisotropic, Coulomb, FrictionLaw, PressureDependent, StaticKinetic
from fingerslip.verification.blocks import PRESSURE, SHEAR_STIFFNESS, dragged
from fingerslip.verification.problem import Check, Problem, absolute, relative

__all__ = ["PROBLEMS"]

# 20 um of press give the pressure of the module blocks.
_DEPTH = 20e-6
# Friction that falls with the slip rate slides steadily only where it falls slowly enough: the law's slope times the
# pressure has to be below the shear stiffness times the step, here by a factor of 0.4, which also is what each step
# leaves of a disturbance.
_STATIC_KINETIC = StaticKinetic(0.5, 0.45, 2e-3)
_POWER = PressureDependent(0.5, PRESSURE, -1 / 3)
_ELLIPSE = Anisotropic(0.6, 0.3)
_DIRECTION = (1.0, 1.0, 0.0)


def _tractions(law: FrictionLaw, element: str, depth: float = _DEPTH, speed: float = 1e-3, step: int = -1) -> float:
    """Return the friction traction [Pa] of the uniform contact along x, at a step."""
    history = dragged(element, law, depth=depth, speed=speed)
    return float(history["tangential_traction"].values[step, :, 0].mean())


def _laws() -> tuple[Check, ...]:
    """Uniform pressure and slip rate: the laws hold at every node to rounding once all slip steadily."""
    checks: list[Check] = []
    for element in ("Q4", "H8"):
        rate = 1e-3
        falling = 0.45 + 0.05 * float(np.exp(-rate / 2e-3))
        doubled = 0.5 * 2 ** (-1 / 3)
        checks += [
            relative(f"{element} Coulomb: t / p", 0.5, _tractions(Coulomb(0.5), element) / PRESSURE, 1e-9),
            relative(f"{element} StaticKinetic: t / p", falling, _tractions(_STATIC_KINETIC, element) / PRESSURE, 1e-6),
            relative(
                f"{element} PressureDependent: t / p at twice the reference pressure",
                doubled,
                _tractions(_POWER, element, depth=2 * _DEPTH) / (2 * PRESSURE),
                1e-9,
            ),
        ]
    return (*checks, *_directions())


def _directions() -> tuple[Check, ...]:
    """Drag along the diagonal: Coulomb's traction follows it, the ellipse's has slip as its normal.

    The normal rule gives t = p (mu_1^2 d_1, mu_2^2 d_2) / sqrt(mu_1^2 d_1^2 + mu_2^2 d_2^2) for slip along d. The
    traction turns to that over slides of mu p / k = 0.25 mm; after 4 mm exp(-16) = 1e-7 is left.
    """
    round_ = dragged("H8", Coulomb(0.5), direction=_DIRECTION)["counterface_force"].values[-1, 0]
    oval = dragged("H8", _ELLIPSE, direction=_DIRECTION, travel=4e-3)["counterface_force"].values[-1, 0]
    scale = float(np.hypot(0.6, 0.3))
    return (
        relative("H8 Coulomb, diagonal: F / N", 0.5, float(np.hypot(round_[0], round_[1]) / round_[2]), 1e-9),
        relative("H8 Coulomb, diagonal: F_y / F_x", 1.0, float(round_[1] / round_[0]), 1e-9),
        relative("H8 Anisotropic, diagonal: F_x / N", 0.36 / scale, float(oval[0] / oval[2]), 1e-5),
        relative("H8 Anisotropic, diagonal: F_y / N", 0.09 / scale, float(oval[1] / oval[2]), 1e-5),
    )


def _slope(of: Callable[[float], float], at: float) -> float:
    """Return the central difference with a relative step of 1e-4."""
    change = 1e-4 * at
    return (of(at + change) - of(at - change)) / (2 * change)


def _tangents() -> tuple[Check, ...]:
    """Take central differences of whole simulations on both sides of stick and slip.

    Their own error is the square of the relative step 1e-4, and rounding over it: 1e-6.
    """
    checks: list[Check] = []
    for element in ("Q4", "H8"):
        # The third step of the slide, at 60 um, sticks: its traction follows the slide and not the pressure.
        history = dragged(element, Coulomb(0.5))
        moved, traction = (
            history["counterface_displacement"].values[:, 0, 0],
            history["tangential_traction"].values[:, 0, 0],
        )
        stick = (traction[4] - traction[3]) / (moved[4] - moved[3])
        slip = (traction[-1] - traction[-2]) / (moved[-1] - moved[-2])
        checks += [
            relative(f"{element} stick: dt / ds [MPa/m]", SHEAR_STIFFNESS / 1e6, float(stick) / 1e6, 1e-6),
            absolute(f"{element} slip: dt / ds [MPa/m]", 0.0, float(slip) / 1e6, 1e-6),
            absolute(f"{element} stick: dt / dp", 0.0, _by_pressure(Coulomb(0.5), element, 3), 1e-6),
            relative(f"{element} slip, Coulomb: dt / dp", 0.5, _by_pressure(Coulomb(0.5), element, -1), 1e-6),
            relative(f"{element} slip, PressureDependent: dt / dp", 1 / 3, _by_pressure(_POWER, element, -1), 1e-6),
            _by_rate(element),
        ]
    return tuple(checks)


def _by_pressure(law: FrictionLaw, element: str, step: int) -> float:
    return _slope(lambda depth: _tractions(law, element, depth=depth, step=step), _DEPTH) * _DEPTH / PRESSURE


def _by_rate(element: str) -> Check:
    rate = 1e-3
    expected = -(0.05 / 2e-3) * float(np.exp(-rate / 2e-3)) * PRESSURE
    found = _slope(lambda speed: _tractions(_STATIC_KINETIC, element, speed=speed), rate)
    return relative(f"{element} slip, StaticKinetic: dt / dv [Pa s/m]", expected, found, 1e-4)


PROBLEMS = (
    Problem("friction-laws", "Every friction law on a uniform contact", "The laws themselves", False, _laws),
    Problem("friction-tangents", "Derivatives of friction in stick and slip", "The laws themselves", False, _tangents),
)
