"""Steps that control their own error: creep and relaxation over minutes, and an oscillator."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.materials.prony import PronyTerm
from fingerslip.model.model import Model, Recording, SupportMotion
from fingerslip.model.programme import Ramp
from fingerslip.model.timing import Adaptive
from fingerslip.sites import Site
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, solve_problem
from fingerslip.verification.viscoelastic import ramp_response

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_SIZE, _MODULUS, _DENSITY, _TRACTION = 10e-3, 34e3, 1000.0, 100.0
_RETARDATION, _HOLD = 0.5, 120.0
_TOLERANCES = 0.03, 0.01, 0.003, 0.001


def _order(errors: list[float]) -> float:
    """Return the power of the tolerance with which errors fall."""
    return float(np.polyfit(np.log(_TOLERANCES), np.log(errors), 1)[0])


def _loaded(damping: float, time: Adaptive) -> xr.Dataset:
    """Return what happens to a bar with an end that is held and one that is pulled from the start on."""
    model = Model(
        mesh=box("Q4", np.array([0.0, _SIZE]), np.array([0.0, _SIZE])),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation="plane_stress",
        supports={"left": ("x",), "bulk": ("y",)},
        tractions={"right": (_TRACTION, 0.0)},
        damping=RayleighDamping(0.0, damping),
        time=time,
        record=Recording(sites=(Site("end", "", (_SIZE, 0.0)),)),
    )
    return solve_problem(model)


def _stretched(history: xr.Dataset) -> Array:
    """Return the displacement of the end over the static one [-]."""
    found: Array = history["displacement"].values[:, 0, 0] / (_TRACTION / _MODULUS * _SIZE)
    return found


def _creep() -> tuple[Check, ...]:
    """Pull a Kelvin-Voigt bar, u = u_oo [1 - exp(-t/tau)], and leave it for 240 retardation times.

    Equal steps h of implicit Euler leave an error of h/(2 e tau), so that many of these would be needed for the same.
    """
    checks, errors, history = list[Check](), list[float](), None
    for tolerance in _TOLERANCES:
        time = Adaptive(0.01, tolerance, "quasi_static", smallest=1e-5, records_per_decade=10, end=_HOLD)
        history = _loaded(_RETARDATION, time)
        exact = -np.expm1(-history["time"].values / _RETARDATION)
        errors.append(float(np.abs(_stretched(history) - exact).max()))
        checks.append(absolute(f"tolerance {tolerance:g}: largest error / u_oo", 0.0, errors[-1], tolerance))
        equal = _HOLD / (2.0 * math.e * _RETARDATION * errors[-1])
        share = history.attrs["steps_taken"] / equal
        checks.append(absolute(f"tolerance {tolerance:g}: steps / equal ones of that error", 0.0, share, 0.05))
    return (*checks, absolute("order in the tolerance", 1.0, _order(errors), 0.2))


def _relaxation() -> tuple[Check, ...]:
    """Stretch a bar of one Prony term, whose bulk modulus does not relax, by a ramp, and hold it for two minutes.

    See :mod:`fingerslip.verification.viscoelastic` for the closed form. Equal steps of a fiftieth of the relaxation
    time would be 60,000.
    """
    share, time, ratio, ramp, shift = 0.6, 0.1, 0.4, 0.1, 0.1e-3
    model = Model(
        mesh=box("Q4", np.linspace(0.0, _SIZE, 3), np.linspace(0.0, _SIZE, 3)),
        materials={"bulk": Elastic(_MODULUS, ratio, _DENSITY, prony=(PronyTerm(share, time),))},
        formulation="plane_stress",
        depth=_SIZE,
        supports={"left": ("x",), "right": ("x",), "bottom": ("y",)},
        support_motions={"right": SupportMotion((shift, 0.0), Ramp((0.0, ramp), (0.0, 1.0)))},
        time=Adaptive(0.01, 1e-4, "quasi_static", records_per_decade=10, end=_HOLD),
    )
    history = solve_problem(model)
    shear, bulk = _MODULUS / (2 * (1 + ratio)), _MODULUS / (3 * (1 - 2 * ratio))
    at_once, in_the_end = (9 * bulk * own / (3 * bulk + own) for own in (shear, (1 - share) * shear))
    slower = (3 * bulk + shear) / (3 * bulk + (1 - share) * shear)
    young = (PronyTerm(1.0 - in_the_end / at_once, slower * time),)
    scale = at_once * shift * _SIZE
    expected = scale * ramp_response(young, ramp, history["time"].values)
    force = history["support_force"].sel(support="right").values[:, 0]
    return (
        absolute("largest error / elastic force", 0.0, float(np.abs(force - expected).max() / scale), 1e-4),
        absolute("steps / equal ones", 0.0, history.attrs["steps_taken"] * time / (50 * _HOLD), 0.02),
    )


def _oscillator() -> tuple[Check, ...]:
    """Let a bar without damping swing about u_oo six times.

    A dynamic step leaves h^3, so that what steps of one tolerance leave together is its power 2/3.
    """
    rotation = float(np.sqrt(3.0 * _MODULUS / _DENSITY)) / _SIZE
    period = 2 * np.pi / rotation
    errors = []
    for tolerance in _TOLERANCES:
        time = Adaptive(period / 8, 0.01 * tolerance, alpha=0.0, smallest=period / 8 / 2**12, end=6 * period)
        history = _loaded(0.0, time)
        exact = 1.0 - np.cos(rotation * history["time"].values)
        errors.append(float(np.abs(_stretched(history) - exact).max()))
    return (absolute("order in the tolerance", 2 / 3, _order(errors), 0.15),)


PROBLEMS: tuple[Problem, ...] = (
    Problem("controlled-creep", "Bar pulled for two minutes, controlled steps", "Kelvin-Voigt body", False, _creep),
    Problem(
        "controlled-relaxation",
        "Bar stretched and held for two minutes, controlled steps",
        "Prony series; Simo & Hughes 1998",
        False,
        _relaxation,
    ),
    Problem("controlled-oscillator", "Bar that swings, controlled steps", "Zienkiewicz & Xie 1991", False, _oscillator),
)
