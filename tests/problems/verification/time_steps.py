"""Time steps: those that control their own error, over minutes and on an oscillator, and the energy of an impact."""

import math

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Problem, absolute, solve_problem
from fingerslip.verification.viscoelastic import stretched_bar
from problems.blocks import fitted_slope

_SIZE, _MODULUS, _DENSITY, _TRACTION = 10e-3, 34e3, 1000.0, 100.0
_RETARDATION, _HOLD = 0.5, 120.0
_TOLERANCES = 0.03, 0.01, 0.003, 0.001


def _loaded(damping, time):
    """Return what happens to a bar that is pulled from the start on, and its stretch over the static one."""
    model = fs.Model(
        mesh=box("Q4", np.array([0.0, _SIZE]), np.array([0.0, _SIZE])),
        materials={"bulk": fs.Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation="plane_stress",
        supports={"left": ("x",), "bulk": ("y",)},
        tractions={"right": (_TRACTION, 0.0)},
        damping=fs.RayleighDamping(0.0, damping),
        time=time,
        record=fs.Recording(sites=(fs.Site("end", "", (_SIZE, 0.0)),)),
    )
    history = solve_problem(model)
    return history, history["displacement"].values[:, 0, 0] / (_TRACTION / _MODULUS * _SIZE)


def _creep():
    """Pull a Kelvin-Voigt bar, u = u_oo [1 - exp(-t/tau)], and leave it for 240 retardation times.

    Equal steps h of implicit Euler leave an error of h/(2 e tau), so that many of these would be needed for the same.
    """
    errors = list[float]()
    for tolerance in _TOLERANCES:
        time = fs.Adaptive(0.01, tolerance, "quasi_static", smallest=1e-5, records_per_decade=10, end=_HOLD)
        history, stretched = _loaded(_RETARDATION, time)
        errors.append(float(np.abs(stretched + np.expm1(-history["time"].values / _RETARDATION)).max()))
        yield absolute(f"tolerance {tolerance:g}: largest error / u_oo", 0.0, errors[-1], tolerance)
        equal = _HOLD / (2.0 * math.e * _RETARDATION * errors[-1])
        share = history.attrs["steps_taken"] / equal
        yield absolute(f"tolerance {tolerance:g}: steps / equal ones of that error", 0.0, share, 0.05)
    yield absolute("order in the tolerance", 1.0, fitted_slope(_TOLERANCES, errors), 0.2)


def _relaxation():
    """Stretch a bar that relaxes by a ramp, and hold it for two minutes.

    Equal steps of a fiftieth of the relaxation time, 0.1 s, would be 60,000.
    """
    time = fs.Adaptive(0.01, 1e-4, "quasi_static", records_per_decade=10, end=_HOLD)
    history, error = stretched_bar("plane_stress", time)
    yield absolute("largest error / elastic force", 0.0, error, 1e-4)
    yield absolute("steps / equal ones", 0.0, history.attrs["steps_taken"] * 0.1 / (50 * _HOLD), 0.02)


def _oscillator():
    """Let a bar without damping swing about u_oo six times.

    A dynamic step leaves h^3, so that what steps of one tolerance leave together is its power 2/3.
    """
    rotation = float(np.sqrt(3.0 * _MODULUS / _DENSITY)) / _SIZE
    period, errors = 2 * np.pi / rotation, []
    for tolerance in _TOLERANCES:
        time = fs.Adaptive(period / 8, 0.01 * tolerance, alpha=0.0, smallest=period / 8 / 2**12, end=6 * period)
        history, stretched = _loaded(0.0, time)
        errors.append(float(np.abs(stretched - 1.0 + np.cos(rotation * history["time"].values)).max()))
    yield absolute("order in the tolerance", 2 / 3, fitted_slope(_TOLERANCES, errors), 0.15)


# A rod of two materials strikes a rigid wall: contact must not make energy, however stiff it is.
_LENGTH, _CELLS, _SOFT, _SPEED = 0.1, 60, 1e6, 0.1
_ALPHAS = (0.0, -0.05, -0.1, -0.2, -1 / 3, -0.41421, -0.5)
#: Penalty stiffness over that of the element at the wall.
_PENALTIES = (1.0, 20.0, 1e3, 1e5)


def _thrown(alpha, penalty):
    """Return the history of a rod, its half at the wall soft, with steps of half a wave's time through a soft cell."""
    size = _LENGTH / _CELLS
    mesh = box("Q4", np.array([0.0, size]), np.linspace(0.0, _LENGTH, _CELLS + 1))
    mesh = mesh.with_subdomains({"soft": lambda x: x[1] < _LENGTH / 2, "stiff": lambda x: x[1] > _LENGTH / 2})
    step = 0.5 * size * (_DENSITY / _SOFT) ** 0.5
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0), -1e-4), fs.Coulomb(0.0), normal_penalty=penalty * _SOFT / size)
    return solve_problem(
        fs.Model(
            mesh=mesh,
            materials={"soft": fs.Elastic(_SOFT, 0.0, _DENSITY), "stiff": fs.Elastic(15.0 * _SOFT, 0.0, _DENSITY)},
            formulation="plane_stress",
            contacts=(contact,),
            initial_velocity=(0.0, -_SPEED),
            time=fs.TimeStepping(step, alpha, end=8 * _CELLS * step),
        ),
        penetration=_LENGTH,
    )


def _impact():
    """Rounding of 480 steps may add up to 1e-11; a step of half a wave's time costs 1 % of the energy, allowed are 2 %.

    The rod has left the wall by the end: what is left of its energy is kinetic and strain energy.
    """
    for alpha in _ALPHAS:
        ratios = [_energy_ratios(_thrown(alpha, penalty)) for penalty in _PENALTIES]
        at = f"alpha = {alpha:.3g}"
        yield absolute(f"{at}: most energy / initial", 1.0, max(most for most, _ in ratios), 1e-11)
        yield absolute(f"{at}: least energy left / initial", 1.0, min(last for _, last in ratios), 0.02)


def _energy_ratios(history):
    """Return the largest and the last energy of body and contact over the first [-]."""
    energy = np.sum([history[name].values for name in ("kinetic_energy", "strain_energy", "contact_energy")], axis=0)
    assert history["contact_state"].values[-1].max() == 0
    return float(energy.max() / energy[0]), float(energy[-1] / energy[0])


_HELD, _SIMO = "Bar stretched and held for two minutes, controlled steps", "Prony series; Simo & Hughes 1998"
PROBLEMS = (
    Problem("controlled-creep", "Bar pulled for two minutes, controlled steps", "Kelvin-Voigt body", _creep),
    Problem("controlled-relaxation", _HELD, _SIMO, _relaxation),
    Problem("controlled-oscillator", "Bar that swings, controlled steps", "Zienkiewicz & Xie 1991", _oscillator),
    Problem("impact", "Rod of two materials thrown at a wall", "Conservation of energy", _impact),
)
